#include <cstdio>
#include <exception>
#include <iostream>

#include "bag_guard.hpp"
#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"
#include "replay.hpp"

namespace {

int runReplay(const std::vector<std::string>& arguments, const std::string& bag) {
  try {
    return jackal_aic::replay(arguments, std::cout);
  } catch (const jackal_aic::ParameterError& error) {
    std::fprintf(stderr, "replay: %s\n", jackal_aic::onOneLine(error.what()).c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "replay: %s\n", jackal_aic::onOneLine(jackal_aic::unreadableBag(bag, error)).c_str());
  }
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  try {
    const std::string bag = jackal_aic::bagOf(arguments);
    if (bag.empty()) return jackal_aic::replay(arguments, std::cout);  // the help, or a complaint
    return jackal_aic::withBag(bag, [&] {
      const int status = runReplay(arguments, bag);
      std::cout.flush();
      return status;
    });
  } catch (const std::exception& error) {
    std::fprintf(stderr, "replay: %s\n", jackal_aic::onOneLine(error.what()).c_str());
    return 2;
  }
}

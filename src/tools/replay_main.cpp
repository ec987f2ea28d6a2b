#include <cstdio>
#include <exception>
#include <iostream>

#include "bag_file.hpp"
#include "jackal_aic/config/text.hpp"
#include "replay.hpp"

int main(int argc, char** argv) {
  return jackal_aic::inChildProcess("replay", [&] {
    try {
      return jackal_aic::replay({argv + 1, argv + argc}, std::cout);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "replay: %s\n", jackal_aic::onOneLine(error.what()).c_str());
      return 2;
    }
  });
}

#include <cstdio>
#include <exception>

#include "commands.hpp"
#include "jackal_aic/config/text.hpp"

int main(int argc, char** argv) {
  try {
    return jackal_aic::sim::runCommand({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "experiments: %s\n", jackal_aic::onOneLine(error.what()).c_str());
    return 1;
  }
}

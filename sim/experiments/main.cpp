#include <cstdio>
#include <exception>

#include "commands.hpp"

int main(int argc, char** argv) {
  try {
    return jackal_aic::sim::runCommand({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "experiments: %s\n", error.what());
    return 1;
  }
}

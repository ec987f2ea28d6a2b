#include <cstdio>
#include <exception>
#include <iostream>

#include "analyze.hpp"

int main(int argc, char** argv) {
  try {
    return jackal_aic::analyze({argv + 1, argv + argc}, std::cout);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "analyze: %s\n", error.what());
    return 1;
  }
}

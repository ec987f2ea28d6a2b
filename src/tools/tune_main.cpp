#include <cstdio>
#include <exception>
#include <iostream>

#include "tune.hpp"

int main(int argc, char** argv) {
  try {
    return jackal_aic::tune({argv + 1, argv + argc}, std::cout);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tune: %s\n", error.what());
    return 1;
  }
}

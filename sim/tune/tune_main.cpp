#include <cstdio>
#include <exception>
#include <iostream>

#include "jackal_aic/config/text.hpp"
#include "tune.hpp"

int main(int argc, char** argv) {
  try {
    return jackal_aic::tune({argv + 1, argv + argc}, std::cout);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tune: %s\n", jackal_aic::onOneLine(error.what()).c_str());
    return 1;
  }
}

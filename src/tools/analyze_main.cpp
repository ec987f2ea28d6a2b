#include <cstdio>
#include <exception>
#include <iostream>

#include "analyze.hpp"
#include "jackal_aic/config/text.hpp"

int main(int argc, char** argv) {
  try {
    return jackal_aic::analyze({argv + 1, argv + argc}, std::cout);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "analyze: %s\n", jackal_aic::onOneLine(error.what()).c_str());
    return 1;
  }
}

#include <cstdio>
#include <exception>
#include <iostream>

#include "jackal_aic/config/text.hpp"
#include "programs.hpp"

// JACKAL_AIC_PROGRAM is one of programs.hpp, JACKAL_AIC_NAME its name.
int main(int argc, char** argv) {
  try {
    return jackal_aic::JACKAL_AIC_PROGRAM({argv + 1, argv + argc}, std::cout);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", JACKAL_AIC_NAME, jackal_aic::onOneLine(error.what()).c_str());
    return 2;
  }
}

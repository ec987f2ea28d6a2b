# Read by find_package(jackal_aic): what a list of libraries cannot say.

# The headers are C++17.
if(NOT CMAKE_CXX_STANDARD)
  set(CMAKE_CXX_STANDARD 17)
elseif(CMAKE_CXX_STANDARD LESS 17)
  message(FATAL_ERROR "jackal_aic needs C++17, not C++${CMAKE_CXX_STANDARD}")
endif()

# Alignment of Eigen's types as the library was built with, whatever instructions the package is compiled for (-march=native).
add_definitions(-DEIGEN_MAX_ALIGN_BYTES=16)

# jackal_aic::core: controllers, drive loop, fault detection, certificate and configuration, with Eigen alone.
# jackal_aic_LIBRARIES names the libraries of ROS too, which a program without ROS need not link.
if(NOT TARGET jackal_aic::core)
  find_package(Eigen3 REQUIRED NO_MODULE)
  set(jackal_aic_core_libraries ${jackal_aic_LIBRARIES})
  list(FILTER jackal_aic_core_libraries INCLUDE REGEX "jackal_aic_")
  add_library(jackal_aic::core INTERFACE IMPORTED)
  set_target_properties(jackal_aic::core PROPERTIES
    INTERFACE_COMPILE_FEATURES cxx_std_17
    INTERFACE_COMPILE_DEFINITIONS EIGEN_MAX_ALIGN_BYTES=16
    INTERFACE_INCLUDE_DIRECTORIES "${jackal_aic_INCLUDE_DIRS}"
    INTERFACE_LINK_LIBRARIES "${jackal_aic_core_libraries};Eigen3::Eigen")
  unset(jackal_aic_core_libraries)
endif()

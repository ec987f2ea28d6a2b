#pragma once

/// @file
/// Reading a bag: the bag library trusts the lengths in a file, so that the memory is bounded before.

#include <rosbag/bag.h>

#include <exception>
#include <string>

namespace jackal_aic {

/// Why a path cannot be that of a bag: a directory, or a pipe or device, which would block or never end. Empty for a
/// file, and for what does not exist. Bounds the memory of this process by the size of the file: a wrong length is then
/// a failed allocation, not a busy machine.
std::string prepareToRead(const std::string& path);

/// Why a bag cannot be read, after its path and on one line, from what the bag library threw.
std::string unreadableBag(const std::string& path, const std::exception& error);

/// Does something with a bag. @throws Error, which `work` throws too, if it cannot be read.
template <class Error, class Work>
void withBag(const std::string& path, const Work& work) {
  if (const std::string refusal = prepareToRead(path); !refusal.empty()) throw Error(refusal);
  try {
    work(rosbag::Bag(path, rosbag::bagmode::Read));
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(unreadableBag(path, error));
  }
}

}  // namespace jackal_aic

#pragma once

/// @file
/// Reading a bag: the bag library trusts the lengths and positions in a file, and dies of some that are damaged.

#include <rosbag/bag.h>

#include <exception>
#include <functional>
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

/// Does the work of a program in a child process, so that a bag of which the library dies is one line. @param program
/// name, for that line. @returns the exit status of the work, or 2.
int inChildProcess(const std::string& program, const std::function<int()>& work);

}  // namespace jackal_aic

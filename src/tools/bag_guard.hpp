#pragma once

/// @file
/// Against damaged bags: the bag library trusts the lengths and positions in a file, and dies of a wrong one in many
/// ways.

#include <exception>
#include <functional>
#include <string>

namespace jackal_aic {

/// Bounds the memory of this process, which is to read a file: a corrupt length then is a failed allocation, not a busy
/// machine.
void boundMemory(const std::string& path);

/// Why a bag cannot be read, after its path and on one line, from what the bag library threw.
std::string unreadableBag(const std::string& path, const std::exception& error);

/// Why a path cannot be that of a bag, in which the library seeks: a directory, or a pipe or device, which would block
/// or never end. Empty for a file, and for what does not exist.
std::string noFile(const std::string& path);

/// Does something with a bag in a process of its own, within bounded memory. @returns its exit status.
/// @throws std::runtime_error, one line, if it is noFile(), or that process was killed, as the bag library is by a
/// damaged file.
int withBag(const std::string& path, const std::function<int()>& work);

}  // namespace jackal_aic

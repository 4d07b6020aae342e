// SPDX-License-Identifier: Apache-2.0
#include "core/unfinished_names.hpp"

#include <array>
#include <atomic>
#include <cstring>
#include <mutex>

#include <climits>
#include <unistd.h>

#include "axiscal/core/output_file.hpp"

namespace axiscal {
namespace {

struct Slot {
  std::atomic<bool> is_used = false;
  std::array<char, PATH_MAX> path{};
};

std::array<Slot, 64> slots;
std::mutex changing;  // locked while slots change; the signal handler only reads them

}  // namespace

void register_unfinished_file(const std::string& path) noexcept {
  const std::lock_guard lock(changing);
  for (Slot& slot : slots) {
    if (!slot.is_used && path.size() < slot.path.size()) {
      std::memcpy(slot.path.data(), path.c_str(), path.size() + 1);
      slot.is_used = true;
      return;
    }
  }
}

void unregister_unfinished_file(const std::string& path) noexcept {
  const std::lock_guard lock(changing);
  for (Slot& slot : slots) {
    if (slot.is_used && path == slot.path.data()) {
      slot.is_used = false;
      return;
    }
  }
}

void remove_unfinished_output() noexcept {
  for (const Slot& slot : slots) {
    if (slot.is_used) {
      ::unlink(slot.path.data());
    }
  }
}

}  // namespace axiscal

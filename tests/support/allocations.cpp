// SPDX-License-Identifier: Apache-2.0
#include "allocations.hpp"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<std::size_t> count = 0;
std::atomic<std::size_t> largest = 0;
}  // namespace

void* operator new(std::size_t size, const std::nothrow_t& /*no throw*/) noexcept {
  ++count;
  if (size > largest) {
    largest = size;
  }
  return std::malloc(size);
}

void* operator new(std::size_t size) {
  if (void* memory = operator new(size, std::nothrow)) {
    return memory;
  }
  throw std::bad_alloc();
}

void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

namespace axiscal::test {

std::size_t allocation_count() {
  return count;
}

void forget_largest_allocation() {
  largest = 0;
}

std::size_t largest_allocation() {
  return largest;
}

}  // namespace axiscal::test

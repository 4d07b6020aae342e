// SPDX-License-Identifier: Apache-2.0
// A C++17 program must get the error that C++20 is needed as its first error.
#include <axiscal/axiscal.hpp>

int main() {}

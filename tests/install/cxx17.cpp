// SPDX-License-Identifier: Apache-2.0
// A program of C++17 is told what is needed, before anything else.
#include <axiscal/axiscal.hpp>

int main() {}

// SPDX-License-Identifier: Apache-2.0
#include "core/late_library.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <memory>

#include "matchers.hpp"

extern "C" int axiscal_test_is_nowhere(int number);

namespace axiscal {
namespace {

using testing::AllOf;
using testing::HasSubstr;

#define AXISCAL_LIBM_FILE "libm.so.6"
#define AXISCAL_LIBM_PACKAGE "libc6"
#define AXISCAL_NOWHERE_FILE "libnowhere.so.9"
#define AXISCAL_NOWHERE_PACKAGE "libnowhere9"
#define AXISCAL_NAMELESS_FILE "libnowhere.so.9"
#define AXISCAL_NAMELESS_PACKAGE ""
#define AXISCAL_LIBC_FILE "libc.so.6"
#define AXISCAL_LIBC_PACKAGE "libc6"

namespace there {
AXISCAL_LATE_LIBRARY(libm, AXISCAL_LIBM)
AXISCAL_LATE(libm, cbrt)
AXISCAL_LATE_LIBRARY(libc, AXISCAL_LIBC)
AXISCAL_LATE(libc, snprintf)
AXISCAL_LATE(libc, malloc)
AXISCAL_LATE(libc, free)

// The call finds the name in this namespace, not C's.
double cube_root(double x) {
  return cbrt(x);
}

std::string text_of(int number) {
  std::array<char, 16> text{};
  snprintf(text.data(), text.size(), "<%d>", number);
  return text.data();
}
}  // namespace there

namespace nowhere {
AXISCAL_LATE_LIBRARY(libnowhere, AXISCAL_NOWHERE)
AXISCAL_LATE(libnowhere, cbrt)
}  // namespace nowhere

namespace nameless {
AXISCAL_LATE_LIBRARY(libnowhere, AXISCAL_NAMELESS)
AXISCAL_LATE(libnowhere, cbrt)
}  // namespace nameless

namespace lacking {
AXISCAL_LATE_LIBRARY(libm, AXISCAL_LIBM)
AXISCAL_LATE(libm, axiscal_test_is_nowhere)
}  // namespace lacking

TEST(LateFunction, IsCalledByItsName) {
  EXPECT_DOUBLE_EQ(there::cube_root(27.0), 3.0);
  EXPECT_DOUBLE_EQ(there::cube_root(-8.0), -2.0);
  EXPECT_EQ(there::text_of(12), "<12>");  // it takes any arguments
}

TEST(LateFunction, IsADeleter) {
  // Both of C: a sanitizer puts its own in front of one alone.
  const std::unique_ptr<void, void (*)(void*)> memory(there::malloc(8), there::free);
  EXPECT_NE(memory, nullptr);
}

TEST(LateFunction, SaysWhatToInstallWhereItsLibraryIsNotThere) {
  EXPECT_THAT(
      [] { static_cast<void>(nowhere::cbrt(1.0)); },
      testing::ThrowsMessage<RefusedError>(AllOf(HasSubstr("libnowhere.so.9 cannot be loaded"),
                                                 HasSubstr("install the package libnowhere9"))));
  EXPECT_THAT([] { static_cast<void>(nameless::cbrt(1.0)); },
              testing::ThrowsMessage<RefusedError>(HasSubstr("cannot be loaded; install it")));
}

TEST(LateFunction, SaysWhenItsLibraryLacksIt) {
  EXPECT_THAT([] { static_cast<void>(lacking::axiscal_test_is_nowhere(1)); },
              testing::ThrowsMessage<RefusedError>(HasSubstr("libm.so.6 cannot be loaded")));
}

}  // namespace
}  // namespace axiscal

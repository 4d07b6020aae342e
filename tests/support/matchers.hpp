// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <gmock/gmock.h>

namespace axiscal::test {

/// @return whether two matrices have one shape and no entries further apart than `tolerance`.
[[nodiscard]] testing::AssertionResult matrices_near(const Eigen::MatrixXd& actual,
                                                     const Eigen::MatrixXd& expected,
                                                     double tolerance);

/// Calls a function and returns what its exception says, or "accepted" where there is none.
template <typename Exception, typename Function>
[[nodiscard]] std::string complaint_of(const Function& call) {
  try {
    call();
  } catch (const Exception& error) {
    return error.what();
  }
  return "accepted";
}

/// Notes of a record, one of which says what `message` matches: `HasNote(HasSubstr("drift"))`.
MATCHER_P(HasNote, message, "") {
  for (const auto& note : arg) {
    if (testing::Value(note.message, message)) {
      return true;
    }
  }
  return false;
}

}  // namespace axiscal::test

/// Holds a matrix or vector (copied, so that no expression dangles) against another, entry by
/// entry.
#define EXPECT_MATRIX_NEAR(actual, expected, tolerance) \
  EXPECT_TRUE(axiscal::test::matrices_near(actual, expected, tolerance))

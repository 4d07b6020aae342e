// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <gmock/gmock.h>

namespace axiscal::test {

/// @return success if both matrices have the same shape and all entries differ by at most
/// `tolerance`.
[[nodiscard]] testing::AssertionResult matrices_near(const Eigen::MatrixXd& actual,
                                                     const Eigen::MatrixXd& expected,
                                                     double tolerance);

/// Calls a function. @return the message of its exception, or "accepted" if it throws none.
template <typename Exception, typename Function>
[[nodiscard]] std::string complaint_of(const Function& call) {
  try {
    call();
  } catch (const Exception& error) {
    return error.what();
  }
  return "accepted";
}

/// Matches a list of notes if the text of one matches `message`: `HasNote(HasSubstr("drift"))`.
MATCHER_P(HasNote, message, "") {
  for (const auto& note : arg) {
    if (testing::Value(note.message, message)) {
      return true;
    }
  }
  return false;
}

}  // namespace axiscal::test

/// Compares a matrix or vector with another one, entry by entry. Arguments are copied, so that no
/// expression dangles.
#define EXPECT_MATRIX_NEAR(actual, expected, tolerance) \
  EXPECT_TRUE(axiscal::test::matrices_near(actual, expected, tolerance))

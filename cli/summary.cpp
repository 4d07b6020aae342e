// SPDX-License-Identifier: Apache-2.0
#include "summary.hpp"

#include <cstdio>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/output_file.hpp"

namespace axiscal::cli {

void print_result_text(const std::string& text) {
  try {
    write_whole_file("-", text);
  } catch (const ClosedPipe&) {
    return;
  }
}

void print_remark(const char* what, const std::string& text) {
  std::fprintf(stderr, "%s\n", wrapped(formatted("{}: {}", what, text), 80).c_str());
}

}  // namespace axiscal::cli

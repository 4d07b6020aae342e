// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table_options.hpp"

namespace axiscal::cli {

/// Corrects the sensors of a log by their records. Writes a table with the time and the field of
/// each sensor in the unit of its record. The columns have the names that they have in the log.
///
/// @param records  files of records of three-axis instruments, at most one per kind of instrument.
/// @param log      a log of any format; - is standard input.
/// @param output   a CSV file; - is standard output.
/// @param force    true if refused records may be used.
void apply_records(const std::vector<std::string>& records,
                   const std::string& log,
                   const TableOptions& table,
                   const std::string& output,
                   bool force);

}  // namespace axiscal::cli

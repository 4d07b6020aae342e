// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table_options.hpp"

namespace axiscal::cli {

/// Corrects the readings of the sensors in a log. Writes a table with the time and the corrected
/// field of each sensor, in the field unit of the sensor's record. The columns keep the names that
/// they have in the log.
///
/// @param records  files of records of three-axis instruments, at most one record per kind.
/// @param log      a log of any format; - is standard input.
/// @param output   a CSV file; - is standard output.
/// @param force    true if refused records may be used.
void apply_records(const std::vector<std::string>& records,
                   const std::string& log,
                   const TableOptions& table,
                   const std::string& output,
                   bool force);

}  // namespace axiscal::cli

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table_options.hpp"

namespace axiscal::cli {

/// Corrects all sensors of a log by their records, one each: a table of the time and, under the
/// log's own names of the columns, each sensor's field in the unit of its record.
///
/// @param records  of three axes or more; no two of one kind of instrument.
/// @param log      of any format; - is standard input.
/// @param output   a CSV file; - is standard output.
/// @param force    whether refused records are used.
void apply_records(const std::vector<std::string>& records,
                   const std::string& log,
                   const TableOptions& table,
                   const std::string& output,
                   bool force);

}  // namespace axiscal::cli

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/run.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The data of a run except its responses, as columns with one value for each reading. Unknown
/// columns stay empty.
struct RunColumns {
  std::vector<std::string> rest;               ///< face on the table: "+X", "-X", .. "-Z"
  std::vector<std::string> fence;              ///< face at the fence
  std::optional<Eigen::VectorXi> run;          ///< numbers of the readings; nullopt: 1, 2, ..
  std::optional<Eigen::VectorXi> block;        ///< number that identifies the block of readings
  std::optional<Eigen::VectorXi> mount;        ///< number that identifies the instrument's mounting
  std::optional<Eigen::VectorXd> level;        ///< factor that multiplies the induced field
  std::optional<Eigen::VectorXd> temperature;  ///< output of the temperature sensor
  std::optional<Eigen::VectorXd> time;         ///< time of the reading [s]
  std::optional<Eigen::VectorXd> samples;      ///< number of samples in each reading
  std::optional<Eigen::MatrixX3d> field;       ///< n x 3, the field in the instrument's frame
};

/// Makes a run from columns, for example from a program's own tables.
///
/// @code
/// axiscal::RunColumns columns;
/// columns.rest = {"-Z", "-Z", "+Z"};
/// columns.fence = {"+X", "-X", "+X"};
/// const axiscal::Run run = axiscal::make_run(columns, volts);  // 3 x m
/// @endcode
///
/// @param response  the readings, n x m [unit of the instrument].
/// @throws DomainError  if a column has another length than `response`, or a face is unknown; the
///                      message names the column.
[[nodiscard]] AXISCAL_EXPORT Run make_run(const RunColumns& columns,
                                          const Eigen::Ref<const Eigen::MatrixXd>& response);

}  // namespace axiscal

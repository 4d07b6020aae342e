// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/run_columns.hpp"

#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/positioner/design_point.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void require_length(const char* column, Eigen::Index length, Eigen::Index readings) {
  if (length != readings) {
    throw DomainError(
        formatted("{}: expected {} values (one per reading), not {}", column, readings, length));
  }
}

template <typename Column>
void require_length(const char* column,
                    const std::optional<Column>& values,
                    Eigen::Index readings) {
  if (values) {
    require_length(column, values->rows(), readings);
  }
}

Face face_of(const std::string& text, const char* column, std::size_t reading) {
  const std::optional<Face> face = parse_face(text);
  if (!face) {
    throw DomainError(
        formatted("{}: '{}' in reading {} is not a face; faces are +X, -X, +Y, -Y, "
                  "+Z and -Z",
                  column, text, reading + 1));
  }
  return *face;
}

}  // namespace

Run make_run(const RunColumns& columns, const Eigen::Ref<const Eigen::MatrixXd>& response) {
  const Eigen::Index n = response.rows();
  const bool has_labels = !columns.rest.empty() || !columns.fence.empty();
  if (has_labels) {
    require_length("rest", static_cast<Eigen::Index>(columns.rest.size()), n);
    require_length("fence", static_cast<Eigen::Index>(columns.fence.size()), n);
  }
  require_length("run", columns.run, n);
  require_length("block", columns.block, n);
  require_length("mount", columns.mount, n);
  require_length("level", columns.level, n);
  require_length("temperature", columns.temperature, n);
  require_length("time", columns.time, n);
  require_length("samples", columns.samples, n);
  require_length("field", columns.field, n);

  Run run;
  Observations& observations = run.observations;
  observations.response = response;
  observations.samples = columns.samples;
  observations.has_block = columns.block.has_value();
  observations.has_level = columns.level.has_value();
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    Reading reading{.run = columns.run ? (*columns.run)(i) : static_cast<int>(i) + 1};
    if (columns.block) {
      reading.block = (*columns.block)(i);
    }
    if (columns.mount) {
      reading.mount = (*columns.mount)(i);
    }
    if (columns.level) {
      reading.level = (*columns.level)(i);
    }
    if (columns.temperature) {
      reading.temperature = (*columns.temperature)(i);
    }
    if (columns.time) {
      reading.time_s = (*columns.time)(i);
    }
    if (has_labels) {
      reading.point = DesignPoint(face_of(columns.rest[at], "rest", at),
                                  face_of(columns.fence[at], "fence", at));
    }
    if (columns.field) {
      reading.field_in_sensor = Eigen::Vector3d(columns.field->row(i).transpose());
    }
    observations.readings.push_back(std::move(reading));
  }
  return run;
}

}  // namespace axiscal

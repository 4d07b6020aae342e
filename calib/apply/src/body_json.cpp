// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <utility>

#include "axiscal/calib/body.hpp"
#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "core/formatted.hpp"
#include "core/json_members.hpp"

namespace axiscal {
namespace {

void members(JsonMembers& io, BodyRotation& body) {
  io.value("created", body.created);
  io.need_matrix("rotation_model_from_sensor", body.rotation_model_from_sensor, 3, 3);
  io.check("rotation_model_from_sensor", is_rotation(body.rotation_model_from_sensor, 1e-6),
           "must be a rotation");
  io.need_matrix("covariance", body.covariance, 3, 3);
  io.value("readings", body.readings);
  io.number("residual_sd_rad", body.residual_sd_rad);
  io.value_if_any("tare_rad", body.tare_rad);
  // If the file lacks `calibration`, the whole covariance is taken as the covariance of the
  // references, so that the rotation is independent of the calibration.
  body.covariance_of_references = io.reads() ? body.covariance : body.covariance_of_references;
  io.object("calibration", !body.parameter_names.empty(), [&](JsonMembers& one) {
    one.value_if_any("record", body.record);
    one.value_if_any("sha256", body.record_sha256);
    one.need("parameter_names", body.parameter_names);
    one.need_matrix("by_parameters", body.by_parameters, 3,
                    static_cast<Eigen::Index>(body.parameter_names.size()));
    one.need_matrix("covariance_of_references", body.covariance_of_references, 3, 3);
  });
  io.number("degrees_of_freedom", body.degrees_of_freedom);
  if (io.reads() && !(body.degrees_of_freedom > 0.0)) {
    // Written as null in the file.
    body.degrees_of_freedom = std::numeric_limits<double>::infinity();
  }
}

// @return the number in a column of the current row.
// @throws DataError  if the cell is not a number.
double number_in(const CsvReader& csv, std::size_t column) {
  const std::optional<double> number = parse_number(csv.cells()[column]);
  if (!number) {
    throw DataError(csv.path(), csv.line(),
                    formatted("column '{}': '{}' is not a finite number", csv.header()[column],
                              csv.cells()[column].substr(0, 40)));
  }
  return *number;
}

std::optional<SensorTemperature> temperature_in(const CsvReader& csv,
                                                const std::vector<std::size_t>& columns) {
  if (columns.empty()) {
    return std::nullopt;
  }
  std::vector<double> all;
  for (const std::size_t column : columns) {
    all.push_back(number_in(csv, column));
  }
  return all.size() == 1 ? SensorTemperature(all.front()) : SensorTemperature(std::move(all));
}

// Sets the attitude or the face of `reading` as stated in the row. Does nothing if the table has
// neither attitude columns nor a face column.
void put_place(const CsvReader& csv,
               const std::optional<std::size_t>& flat,
               const std::optional<std::size_t>& pitch,
               const std::optional<std::size_t>& roll,
               ReferenceReading& reading) {
  const auto empty = [&](const std::optional<std::size_t>& column) {
    return !column || csv.cells()[*column].empty();
  };
  if (!flat && !pitch) {
    return;
  }
  const bool is_flat = !empty(flat);
  const bool has_attitude = !empty(pitch) || !empty(roll);
  if (is_flat == has_attitude) {
    throw DataError(csv.path(), csv.line(),
                    is_flat ? "this row has both an attitude and a flat face; give only one of them"
                            : "this row has neither an attitude ('pitch_deg', 'roll_deg') nor the "
                              "face that lies on the table ('flat')");
  }
  if (is_flat) {
    reading.flat = parse_face(csv.cells()[*flat]);
    if (!reading.flat) {
      throw DataError(
          csv.path(), csv.line(),
          formatted("column 'flat': '{}' is not a face; the faces are +X -X +Y -Y +Z -Z",
                    csv.cells()[*flat].substr(0, 40)));
    }
    return;
  }
  reading.attitude = {.pitch_rad = number_in(csv, *pitch) * rad_per_deg,
                      .roll_rad = number_in(csv, *roll) * rad_per_deg};
}

}  // namespace

std::vector<ReferenceReading> read_references(CsvReader& csv, const Calibration& calibration) {
  const std::vector<ReadingColumn> axes = columns_in(csv, calibration);
  const TemperaturePlaces temperatures = temperature_places(csv, axes, calibration.sensor);
  const std::optional<std::size_t> flat = csv.column("flat");
  std::optional<std::size_t> pitch = csv.column("pitch_deg");
  std::optional<std::size_t> roll = csv.column("roll_deg");
  if (pitch || roll) {
    pitch = csv.need("pitch_deg");
    roll = csv.need("roll_deg");
  }
  std::vector<ReferenceReading> all;
  for (CsvReader::Row row = csv.next(); row != CsvReader::Row::end; row = csv.next()) {
    if (row == CsvReader::Row::defective) {
      throw DataError(csv.path(), csv.line(), csv.defect());
    }
    ReferenceReading& reading = all.emplace_back(
        ReferenceReading{.row = static_cast<int>(all.size()) + 1,
                         .readings = Eigen::VectorXd(static_cast<Eigen::Index>(axes.size()))});
    for (std::size_t k = 0; k < axes.size(); ++k) {
      const double minus = axes[k].minus.empty() ? 0.0 : number_in(csv, csv.need(axes[k].minus));
      reading.readings(static_cast<Eigen::Index>(k)) =
          number_in(csv, csv.need(axes[k].plus)) - minus;
    }
    reading.temperature = temperature_in(csv, temperatures);
    put_place(csv, flat, pitch, roll, reading);
  }
  if (all.empty()) {
    throw DataError(csv.path(), csv.line(), "the file has a header, but no readings");
  }
  return all;
}

std::string body_rotation_json(const BodyRotation& body) {
  JsonWriter writer;
  writer.begin_object();
  JsonMembers io(writer);
  io.put("format", "axiscal-rotation");
  io.put("version", 1);
  BodyRotation written = body;
  members(io, written);
  writer.end_object();
  return writer.finish();
}

BodyRotation parse_body_rotation(std::string_view text, const std::string& path) {
  const JsonValue json = parse_json(text, path);
  json.require_format("axiscal-rotation");
  BodyRotation body;
  JsonMembers io(json);
  members(io, body);
  return body;
}

BodyRotation read_body_rotation(const std::string& path) {
  return parse_body_rotation(read_whole_file(path), path);
}

}  // namespace axiscal

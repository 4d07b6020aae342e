// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/recorded_field.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/settings.hpp"
#include "core/formatted.hpp"
#include "core/json_members.hpp"

namespace axiscal {
namespace {

double number_of(const CsvReader& csv, std::size_t column) {
  const std::optional<double> number = parse_number(csv.cells()[column]);
  if (!number) {
    throw DataError(
        csv.path(), csv.line(),
        formatted("column '{}': '{}' is not a number", csv.header()[column], csv.cells()[column]));
  }
  return *number;
}

double time_of(const CsvReader& csv, std::size_t column) {
  const std::string_view text = csv.cells()[column];
  if (const std::optional<double> number = parse_number(text)) {
    return *number;
  }
  const std::optional<double> stamp = parse_timestamp(text);
  if (!stamp) {
    throw DataError(csv.path(), csv.line(),
                    formatted("column 'time': '{}' is neither seconds nor an ISO 8601 time", text));
  }
  return *stamp;
}

}  // namespace

RecordedField::RecordedField(std::shared_ptr<const ReferenceField> of,
                             std::vector<double> times_s,
                             Eigen::Matrix3Xd in_table,
                             std::string path)
    : of_(std::move(of)),
      times_s_(std::move(times_s)),
      in_table_(std::move(in_table)),
      path_(std::move(path)) {
  if (!of_ || times_s_.size() < 2 ||
      static_cast<Eigen::Index>(times_s_.size()) != in_table_.cols()) {
    throw DomainError("a recorded field needs a kind, and vectors at two times or more");
  }
  for (std::size_t i = 0; i < times_s_.size(); ++i) {
    const Eigen::Vector3d value = in_table_.col(static_cast<Eigen::Index>(i));
    if (!std::isfinite(times_s_[i]) || (i > 0 && !(times_s_[i] > times_s_[i - 1]))) {
      throw DomainError(
          formatted("the times of a recorded field must increase from row to row, "
                    "but the time {} does not",
                    number_text(times_s_[i])));
    }
    if (!value.allFinite() || !(value.norm() > 0.0)) {
      throw DomainError(formatted("a recorded field is zero or not finite at the time {}",
                                  number_text(times_s_[i])));
    }
  }
}

Eigen::Vector3d RecordedField::value_in_enu() const {
  return in_table_.rowwise().mean();
}

Eigen::Vector3d RecordedField::value_in_enu_at(double time_s) const {
  if (!(time_s >= times_s_.front() && time_s <= times_s_.back())) {
    throw RefusedError(formatted(
        "the recording of the field is from time {} to {}, but a reading is at time {}; record the "
        "field from the first reading to the last, with the clock of the readings",
        number_text(times_s_.front()), number_text(times_s_.back()), number_text(time_s)));
  }
  const auto after = std::lower_bound(times_s_.begin() + 1, times_s_.end(), time_s);
  const auto at = static_cast<Eigen::Index>(after - times_s_.begin());
  const double before_s = *(after - 1);
  const double part = (time_s - before_s) / (*after - before_s);
  return (1.0 - part) * in_table_.col(at - 1) + part * in_table_.col(at);
}

Eigen::Vector3d RecordedField::moving_in_table(const TablePlace& /*place*/, double time_s) const {
  return value_in_enu_at(time_s);
}

void RecordedField::resolve(FieldResolver& of) const {
  const Eigen::Vector3d value =
      of.reading_time_s() ? value_in_enu_at(*of.reading_time_s()) : value_in_enu();
  if (of.given().magnitude) {
    throw SetupError(
        "the recording of the field contains its magnitude; do not give another magnitude",
        {settings::field_magnitude});
  }
  of.set_magnitude(value.norm());
  of.found().in_table = value;
  of.found().start.sign_by = value.normalized();
}

void RecordedField::members(JsonMembers& io) {
  io.value_if_any("recorded", path_);
}

RecordedField read_recorded_field(const std::string& path,
                                  std::shared_ptr<const ReferenceField> of) {
  InputFile file(path);
  CsvReader csv([&](char* to, std::size_t size) { return file.read(to, size); }, path);
  const std::optional<std::size_t> time = csv.column("time");
  if (!time || csv.header().size() != 4) {
    throw DataError(path,
                    "a recording of the field must have a column 'time' and three more columns: "
                    "the components along the table's x, y and z");
  }
  std::vector<double> times_s;
  std::vector<double> components;
  for (CsvReader::Row row = csv.next(); row != CsvReader::Row::end; row = csv.next()) {
    if (row == CsvReader::Row::defective) {
      throw DataError(path, csv.line(), csv.defect());
    }
    times_s.push_back(time_of(csv, *time));
    for (std::size_t column = 0; column < csv.header().size(); ++column) {
      if (column != *time) {
        components.push_back(number_of(csv, column));
      }
    }
  }
  try {
    return {std::move(of), std::move(times_s),
            Eigen::Map<const Eigen::Matrix3Xd>(components.data(), 3,
                                               static_cast<Eigen::Index>(components.size() / 3)),
            path};
  } catch (const DomainError& error) {
    throw DataError(path, error.what());
  }
}

}  // namespace axiscal

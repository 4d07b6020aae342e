// SPDX-License-Identifier: Apache-2.0
#include "axiscal/exchange/import.hpp"

#include <array>
#include <cmath>
#include <map>

#include <Eigen/LU>
#ifdef AXISCAL_YAML
#include <yaml-cpp/yaml.h>
#endif

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/exchange/settings.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "exchange/src/formats.hpp"

namespace axiscal {
namespace {

struct Source {
  std::string_view text;
  const std::string& path;
  const ImportOptions& options;

  [[nodiscard]] bool is(std::string_view kind) const { return options.kind == kind; }
};

// The calibration in a file, converted to the model v = sensitivity * field + bias.
struct Imported {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Matrix3d sensitivity = Eigen::Matrix3d::Identity();
  std::string unit;        // unit of the readings
  std::string field_unit;  // unit of the field
  std::vector<std::string> notes;
};

Eigen::Matrix3d inverted(const Source& source, const Eigen::Matrix3d& M) {
  const Eigen::Matrix3d inverse = M.inverse();
  if (!M.allFinite() || !(std::abs(M.determinant()) > 0.0) || !inverse.allFinite() ||
      inverse.isZero(0.0)) {
    throw DataError(source.path,
                    "the matrix of this calibration cannot be inverted: a scale factor is 0, not a "
                    "number, or far too large or small");
  }
  return inverse;
}

// ---- Parameters of flight controllers ----

using ParameterTable = std::map<std::string, double>;

// Reads lines with the given number of columns. `name_at` and `value_at` are the zero-based indices
// of the columns with the name and the value.
ParameterTable read_parameters(const Source& source,
                               std::string_view separators,
                               std::size_t name_at,
                               std::size_t value_at,
                               std::size_t columns) {
  ParameterTable table;
  std::size_t line_number = 0;
  for (const std::string_view whole : split(source.text, '\n')) {
    ++line_number;
    const std::string_view line = trimmed(whole.substr(0, whole.find('\r')));
    if (line.empty() || line.starts_with('#')) {
      continue;
    }
    std::vector<std::string_view> parts;
    std::size_t at = 0;
    while (at < line.size()) {
      const std::size_t end = std::min(line.find_first_of(separators, at), line.size());
      if (end > at) {
        parts.push_back(line.substr(at, end - at));
      }
      at = end + 1;
    }
    const std::optional<double> value =
        parts.size() == columns ? parse_number(parts[value_at]) : std::nullopt;
    if (!value) {
      throw DataError(
          source.path, line_number,
          formatted("this line does not contain the name of a parameter and a number; each line of "
                    "this format has {} columns",
                    columns));
    }
    if (!table.emplace(parts[name_at], *value).second) {
      throw DataError(source.path, line_number,
                      formatted("parameter {} occurs twice", parts[name_at]));
    }
  }
  return table;
}

// Reads three parameters. Each name consists of the prefix, the letter X, Y or Z, and the suffix.
// If all three parameters are missing, each value is `otherwise`.
Eigen::Vector3d axes_of(const Source& source,
                        const ParameterTable& table,
                        const std::string& prefix,
                        const std::string& suffix,
                        std::optional<double> otherwise) {
  Eigen::Vector3d values;
  int found = 0;
  std::string missing;
  for (int k = 0; k < 3; ++k) {
    const std::string name = axis_parameter(prefix, k, suffix);
    const auto at = table.find(name);
    if (at != table.end()) {
      ++found;
      values(k) = at->second;
    } else if (missing.empty()) {
      missing = name;
    }
  }
  if (found == 0 && otherwise) {
    return Eigen::Vector3d::Constant(*otherwise);
  }
  if (found != 3) {
    throw DataError(source.path, "the file has no " + missing);
  }
  return values;
}

Eigen::Matrix3d symmetric(const Eigen::Vector3d& diagonal, const Eigen::Vector3d& above) {
  Eigen::Matrix3d M;
  M << diagonal(0), above(0), above(1), above(0), diagonal(1), above(2), above(1), above(2),
      diagonal(2);
  return M;
}

Imported import_px4(const Source& source) {
  const ParameterTable table = read_parameters(source, "\t ", 2, 3, 5);
  const std::string number = formatted("{}_", source.options.instance);
  Imported result;
  if (source.is("accelerometer")) {
    const std::string prefix = "CAL_ACC" + number;
    result.unit = result.field_unit = "m/s^2";
    result.bias = axes_of(source, table, prefix, "OFF", std::nullopt);
    result.sensitivity =
        inverted(source, axes_of(source, table, prefix, "SCALE", 1.0).asDiagonal().toDenseMatrix());
  } else if (source.is("gyroscope")) {
    result.unit = result.field_unit = "rad/s";
    result.bias = axes_of(source, table, "CAL_GYRO" + number, "OFF", std::nullopt);
  } else {
    const std::string prefix = "CAL_MAG" + number;
    result.unit = result.field_unit = "G";
    result.bias = axes_of(source, table, prefix, "OFF", std::nullopt);
    result.sensitivity = inverted(source, symmetric(axes_of(source, table, prefix, "SCALE", 1.0),
                                                    axes_of(source, table, prefix, "ODIAG", 0.0)));
  }
  return result;
}

Imported import_ardupilot(const Source& source) {
  const ParameterTable table = read_parameters(source, ", \t", 0, 1, 2);
  const int instance = source.options.instance;
  const std::string number = instance == 0 ? "" : std::to_string(instance + 1);
  const std::string ins = ardupilot_group(instance, source.is("gyroscope") ? "GYR" : "ACC");
  Imported result;
  if (source.is("accelerometer")) {
    result.unit = result.field_unit = "m/s^2";
    result.bias = axes_of(source, table, ins + "OFFS_", "", std::nullopt);
    result.sensitivity = inverted(
        source, axes_of(source, table, ins + "SCAL_", "", 1.0).asDiagonal().toDenseMatrix());
  } else if (source.is("gyroscope")) {
    result.unit = result.field_unit = "rad/s";
    result.bias = axes_of(source, table, ins + "OFFS_", "", std::nullopt);
  } else {
    result.unit = result.field_unit = "mG";
    result.bias = -axes_of(source, table, formatted("COMPASS_OFS{}_", number), "", std::nullopt);
    Eigen::Vector3d diagonal = axes_of(source, table, formatted("COMPASS_DIA{}_", number), "", 1.0);
    if (diagonal.isZero(0.0)) {
      diagonal.setOnes();  // ArduPilot treats a diagonal of zeros as ones
    }
    const auto scale = table.find("COMPASS_SCALE" + number);
    const double factor = scale != table.end() && scale->second != 0.0 ? scale->second : 1.0;
    result.sensitivity = inverted(
        source,
        factor * symmetric(diagonal,
                           axes_of(source, table, formatted("COMPASS_ODI{}_", number), "", 0.0)));
  }
  return result;
}

// ---- imucal ----

template <int columns>
Eigen::Matrix<double, 3, columns> json_numbers(const Source& source,
                                               const Json& json,
                                               const std::string& key) {
  Eigen::Matrix<double, 3, columns> M;
  const Json value = json.contains(key) ? json[key] : Json();
  const auto fail = [&]() -> DataError {
    return DataError(source.path, std::string_view("/" + key),
                     columns == 1 ? "three numbers are needed"
                                  : "three rows of three numbers are "
                                    "needed");
  };
  if (!value.is_array() || value.size() != 3) {
    throw fail();
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Json row = columns == 1 ? Json::array({value[i]}) : value[i];
    if (!row.is_array() || row.size() != columns) {
      throw fail();
    }
    for (std::size_t j = 0; j < columns; ++j) {
      if (!row[j].is_number()) {
        throw fail();
      }
      M(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = row[j].get<double>();
    }
  }
  return M;
}

std::string json_text(const Json& json, const std::string& key, const std::string& otherwise) {
  return json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : otherwise;
}

Eigen::Matrix3d json_product(const Source& source,
                             const Json& json,
                             const std::string& first,
                             const std::string& second) {
  const Eigen::Matrix3d K = json_numbers<3>(source, json, first);
  return K * json_numbers<3>(source, json, second);
}

// Reads imucal's Ferraris calibration. The reading is v = K R f + b, with the scale matrix K, the
// rotation R, the field f and the bias b. A gyroscope's reading also contains the term K_ga a, its
// response to the specific force a.
Imported import_imucal(const Source& source) {
  const Json json = json_or_discarded(source.text);
  if (!json.is_object() || !json.contains("K_a")) {
    throw DataError(source.path, std::string_view("/"),
                    "not a calibration file of imucal: an object with K_a, R_a, b_a, ... is "
                    "needed");
  }
  Imported result;
  if (source.is("accelerometer")) {
    result.unit = json_text(json, "from_acc_unit", "a.u.");
    result.field_unit = json_text(json, "acc_unit", "m/s^2");
    result.sensitivity = json_product(source, json, "K_a", "R_a");
    result.bias = json_numbers<1>(source, json, "b_a");
  } else if (source.is("gyroscope")) {
    result.unit = json_text(json, "from_gyr_unit", "a.u.");
    result.field_unit = json_text(json, "gyr_unit", json_text(json, "gyro_unit", "deg/s"));
    result.sensitivity = json_product(source, json, "K_g", "R_g");
    result.bias = json_numbers<1>(source, json, "b_g");
    if (json.contains("K_ga") && !json_numbers<3>(source, json, "K_ga").isZero(0.0)) {
      result.notes.emplace_back("the response to gravity in the file (K_ga) is not imported");
    }
  } else {
    throw DataError(source.path, "imucal does not calibrate magnetometers");
  }
  static_cast<void>(inverted(source, result.sensitivity));
  return result;
}

// ---- Kalibr ----

#ifdef AXISCAL_YAML
// Reads a number. Refuses .nan and .inf, which YAML allows.
double yaml_number(const Source& source, const YAML::Node& node, const std::string& key) {
  const double number = node.as<double>();
  if (!std::isfinite(number)) {
    throw DataError(source.path, static_cast<std::size_t>(std::max(node.Mark().line, 0)) + 1,
                    key + ": must be a finite number");
  }
  return number;
}

Eigen::Matrix3d yaml_matrix(const Source& source, const YAML::Node& of, const std::string& key) {
  const YAML::Node node = of[key];
  Eigen::Matrix3d M;
  try {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        M(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            yaml_number(source, node[i][j], key);
      }
    }
  } catch (const YAML::Exception&) {
    throw DataError(source.path, key + ": three rows of three numbers are needed");
  }
  return M;
}

Imported read_kalibr(const Source& source) {
  const YAML::Node root = YAML::Load(std::string(source.text));
  const std::string imu = formatted("imu{}", source.options.instance);
  const std::string sensor = source.is("gyroscope") ? "gyroscopes" : "accelerometers";
  if (source.is("magnetometer")) {
    throw DataError(source.path, "Kalibr does not calibrate magnetometers");
  }
  if (!root.IsMap() || !root[imu] || !root[imu].IsMap() || !root[imu][sensor] ||
      !root[imu][sensor].IsMap()) {
    throw DataError(source.path,
                    formatted("the file does not contain {} with {} (M, C, ...)", imu, sensor));
  }
  const YAML::Node node = root[imu][sensor];
  Imported result;
  result.unit = result.field_unit = source.is("gyroscope") ? "rad/s" : "m/s^2";
  const std::string rotation = source.is("gyroscope") ? "C_gyro_i" : "C";
  result.sensitivity = yaml_matrix(source, node, "M");
  if (node[rotation]) {
    result.sensitivity = (result.sensitivity * yaml_matrix(source, node, rotation)).eval();
  }
  if (const YAML::Node bias = node["bias"]) {
    try {
      for (std::size_t k = 0; k < 3; ++k) {
        result.bias(static_cast<Eigen::Index>(k)) = yaml_number(source, bias[k], "bias");
      }
    } catch (const YAML::Exception&) {
      throw DataError(source.path, "bias: three numbers are needed");
    }
  } else {
    result.notes.emplace_back("the file does not contain a bias: 0 is assumed");
  }
  if (node["A"] && !yaml_matrix(source, node, "A").isZero(0.0)) {
    result.notes.emplace_back("the response to acceleration in the file (A) is not imported");
  }
  static_cast<void>(inverted(source, result.sensitivity));
  return result;
}

Imported import_kalibr(const Source& source) {
  const auto fail = [&](const char* what, const YAML::Exception& error) -> DataError {
    return {source.path, static_cast<std::size_t>(std::max(error.mark.line, 0)) + 1,
            what + error.msg};
  };
  try {
    return read_kalibr(source);
  } catch (const YAML::ParserException& error) {
    throw fail("not valid YAML: ", error);
  } catch (const YAML::Exception& error) {
    throw fail("not a calibration file of Kalibr: ", error);
  }
}
#endif

struct KnownImport {
  std::string_view name;
  Imported (*read)(const Source& source);
};

constexpr std::array known_imports = {
    KnownImport{"ardupilot", import_ardupilot},
    KnownImport{"imucal", import_imucal},
#ifdef AXISCAL_YAML
    KnownImport{"kalibr", import_kalibr},
#endif
    KnownImport{"px4", import_px4},
};

Imported read_by_format(const Source& source, std::string_view format) {
  for (const KnownImport& one : known_imports) {
    if (one.name == format) {
      return one.read(source);
    }
  }
  throw DomainError(
      formatted("unknown format '{}'{}", format, did_you_mean(format, import_formats())));
}

struct UsualField {
  std::string_view sensor;
  std::string_view kind;
  std::string_view unit;
  double magnitude;
};

constexpr std::array usual_fields = {
    UsualField{"accelerometer", "gravity", "m/s^2", standard_gravity},
    UsualField{"accelerometer", "gravity", "g", 1.0},
    UsualField{"gyroscope", "induced_rotation", "rad/s", 1.0},
    UsualField{"gyroscope", "induced_rotation", "deg/s", deg_per_rad},
    UsualField{"magnetometer", "geomagnetic", "G", 0.5},
    UsualField{"magnetometer", "geomagnetic", "mG", 500.0},
};

}  // namespace

std::span<const std::string_view> import_formats() {
  static const auto names = [] {
    std::array<std::string_view, known_imports.size()> all;
    std::transform(known_imports.begin(), known_imports.end(), all.begin(),
                   [](const KnownImport& one) { return one.name; });
    return all;
  }();
  return names;
}

Calibration import_calibration(std::string_view text,
                               const std::string& path,
                               std::string_view format,
                               const ImportOptions& options) {
  if (options.kind != "accelerometer" && options.kind != "gyroscope" &&
      options.kind != "magnetometer") {
    throw DomainError(
        formatted("the kind '{}' must be accelerometer, gyroscope or magnetometer", options.kind));
  }
  if (options.instance < 0 || options.instance > 9) {
    throw DomainError("the index of the sensor must be 0 to 9");
  }
  const Imported imported = read_by_format({text, path, options}, format);
  Calibration calibration;
  calibration.provenance.created = output_timestamp();
  calibration.provenance.software = software_name();
  calibration.sensor.instrument = {.kind = options.kind, .unit = imported.unit};
  calibration.sensor.field.unit = imported.field_unit;
  calibration.sensor.field.magnitude = 0.0;
  for (const UsualField& usual : usual_fields) {
    if (usual.sensor == options.kind) {
      calibration.sensor.field.kind = usual.kind;
      if (usual.unit == imported.field_unit) {
        calibration.sensor.field.magnitude = usual.magnitude;
      }
    }
  }
  calibration.sensor.field.magnitude =
      options.magnitude.value_or(calibration.sensor.field.magnitude);
  if (!(calibration.sensor.field.magnitude > 0.0)) {
    throw DomainError(formatted("give the magnitude of the field in {}", imported.field_unit),
                      {settings::imported_magnitude});
  }
  calibration.sensor.response.bias = imported.bias;
  calibration.sensor.response.sensitivity = imported.sensitivity;
  calibration.findings.notes.push_back(
      {NoteCode::imported,
       formatted("imported from {} ({}): coefficients only, without uncertainty", path, format)});
  for (const std::string& note : imported.notes) {
    calibration.findings.notes.push_back({NoteCode::imported, note});
  }
  try {
    // Throws if the record is invalid.
    static_cast<void>(parse_calibration(calibration_json(calibration), "the record"));
  } catch (const DomainError& error) {
    throw DataError(path, error.what());
  }
  return calibration;
}

}  // namespace axiscal

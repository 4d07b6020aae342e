// SPDX-License-Identifier: Apache-2.0
#include "sample_rests.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/logs/sample_rests.hpp"
#include "axiscal/logs/signed_counts.hpp"
#include "core/formatted.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

constexpr const char* say_the_faces =
    "give the face on the table in each rest: in a column 'rest' (-Z: the face -Z is on the "
    "table), or as words with --face-names";

bool has_poses(const Observations& observations) {
  return std::any_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) {
                       return reading.point || reading.field_in_sensor || reading.attitude;
                     });
}

// Returns the face that lay on the table, according to the name of a file; nullopt if the name
// states no face.
std::optional<Face> face_of_file(const std::string& path) {
  const std::optional<FaceInWords> face =
      face_in_words(std::filesystem::path(path).stem().string());
  if (!face || !face->is_up) {
    return std::nullopt;
  }
  return *face->is_up ? opposite(face->face) : face->face;
}

// Returns the face on the table in each period at rest, according to the file names. The result is
// empty unless each period has its own file and each file name states a face.
std::vector<std::optional<Face>> faces_of_files(const Run& run) {
  std::vector<std::optional<Face>> faces;
  if (run.inputs.size() != run.observations.readings.size()) {
    return faces;
  }
  for (const InputFileDigest& input : run.inputs) {
    faces.push_back(face_of_file(input.path));
    if (!faces.back()) {
      return {};
    }
  }
  return faces;
}

// Compares the faces from the file names with the faces from the measured gravity. In all periods
// at rest, the two faces must be equal, or in all periods they must be opposite. They are opposite
// if the sensitivities are negative.
// @throws RefusedError  if neither is true.
void require_agreement(const Run& run,
                       const std::vector<std::optional<Face>>& named,
                       const std::vector<std::optional<Face>>& seen) {
  std::size_t opposed = 0;
  for (std::size_t i = 0; i < named.size(); ++i) {
    opposed += seen[i] && *seen[i] == opposite(*named[i]) ? 1U : 0U;
  }
  const bool is_turned = opposed == named.size();
  for (std::size_t i = 0; i < named.size() && !is_turned; ++i) {
    if (seen[i] != named[i]) {
      throw RefusedError(formatted(
          "{}: the file name says that face {} is on the table, but the readings show {}; rename "
          "the file",
          run.inputs[i].path, face_name(*named[i]),
          seen[i] ? "the face " + std::string(face_name(*seen[i]))
                  : "that the instrument lay on "
                    "an edge"));
    }
  }
  if (is_turned) {
    print_remark(
        "note",
        "according to the file names, each axis has its smaller reading if it points up, so the "
        "sensitivities are negative");
  }
}

}  // namespace

namespace {

// Removes readings of erased memory. All bits of such a reading are 1, so the values of all axes
// are equal.
void leave_erased_out(Run& run) {
  const Eigen::MatrixXd& response = run.observations.response;
  constexpr Eigen::Index fewest_axes = 3;
  std::vector<std::size_t> rows;
  for (Eigen::Index i = 0; i < response.rows(); ++i) {
    const double first = response(i, 0);
    const bool is_erased = response.cols() >= fewest_axes &&
                           (first == 65535.0 || first == 4294967295.0 || first == 4294967.295) &&
                           (response.row(i).array() == first).all();
    if (!is_erased) {
      rows.push_back(static_cast<std::size_t>(i));
    }
  }
  const std::size_t erased = run.observations.readings.size() - rows.size();
  if (erased == 0 || rows.empty() || !run.serials.empty() || run.inputs.size() > 1) {
    return;
  }
  print_remark("note", formatted("{} readings of erased memory (all bits 1) are left out", erased));
  run.observations = select_rows(run.observations, rows);
  run.rows_of_inputs.clear();
  run.dates.clear();
  run.operators.clear();
}

}  // namespace

void restore_count_signs(Run& run) {
  leave_erased_out(run);
  Eigen::MatrixXd& response = run.observations.response;
  std::vector<std::span<const double>> columns;
  std::vector<std::string> names;
  for (Eigen::Index c = 0; c < response.cols(); ++c) {
    columns.emplace_back(response.col(c).data(), static_cast<std::size_t>(response.rows()));
    names.push_back(c < static_cast<Eigen::Index>(run.axes.size())
                        ? run.axes[static_cast<std::size_t>(c)]
                        : formatted("axis {}", c + 1));
  }
  const SignedCounts counts = find_signed_counts(columns);
  for (const std::size_t column : counts.columns) {
    for (double& value : response.col(static_cast<Eigen::Index>(column))) {
      value = with_sign(value, counts.bits);
    }
  }
  if (counts.bits > 0) {
    print_remark("note", words_of(counts, names));
  }
}

bool gather_rests(const std::string& instrument, Run& run) {
  if (!run.slots.empty() || !run.serials.empty() ||
      !find_instrument_kind(instrument).has_axis_elevation) {
    return false;
  }
  const std::optional<SampleRests> rests = rests_of_samples(run.observations);
  if (!rests) {
    return false;
  }
  print_remark("note", formatted("the {} readings are samples of {} rests; each rest's mean is one "
                                 "reading{}",
                                 run.observations.readings.size(), rests->rows.size(),
                                 rests->samples < run.observations.readings.size()
                                     ? formatted(", and {} samples outside the rests are left out",
                                                 run.observations.readings.size() - rests->samples)
                                     : ""));
  if (!rests->unsettled.empty()) {
    print_remark("warning", rests->unsettled);
  }
  std::vector<std::size_t> rows_of_inputs;
  std::size_t end = 0;
  for (const std::size_t rows : run.rows_of_inputs) {
    const std::size_t begin = end;
    end += rows;
    rows_of_inputs.push_back(static_cast<std::size_t>(
        std::count_if(rests->rows.begin(), rests->rows.end(),
                      [&](std::size_t row) { return row >= begin && row < end; })));
  }
  const auto chosen = [&](const std::vector<std::string>& all) {
    std::vector<std::string> of_rests;
    for (const std::size_t row : rests->rows) {
      if (!all.empty()) {
        of_rests.push_back(all[row]);
      }
    }
    return of_rests;
  };
  run.rows_of_inputs = std::move(rows_of_inputs);
  run.dates = chosen(run.dates);
  run.operators = chosen(run.operators);
  run.observations = rests->readings;
  return true;
}

void label_faces(Run& run) {
  Observations& readings = run.observations;
  std::vector<std::optional<Face>> faces = faces_of_files(run);
  std::vector<std::optional<Face>> seen;
  try {
    seen = faces_by_gravity(readings);
  } catch (const RefusedError& error) {
    if (faces.empty()) {
      throw RefusedError(
          formatted("{} orientations are too few for the method 'magnitude', and gravity does not "
                    "determine the faces ({}); {}",
                    readings.readings.size(), error.what(), say_the_faces));
    }
    seen = faces;  // gravity shows too few orientations to determine the faces
  }
  if (seen.empty()) {
    return;
  }
  if (!faces.empty()) {
    require_agreement(run, faces, seen);
    print_remark("note", "the faces on the table are taken from the file names: '" +
                             std::filesystem::path(run.inputs.front().path).filename().string() +
                             "' means " + std::string(face_name(*faces.front())));
  } else {
    faces = std::move(seen);
    print_remark("note",
                 formatted("the faces on the table in the {} rests are recognised by gravity; a "
                           "column 'rest' can name the faces instead",
                           faces.size()));
  }
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i]) {
      readings.readings[i].point =
          DesignPoint(*faces[i], face_of((axis_of(*faces[i]) + 1) % 3, true));
      rows.push_back(i);
    }
  }
  if (rows.size() < faces.size()) {
    print_remark(
        "note",
        formatted("in {} of the rests the instrument lay on an edge; these rests are left out",
                  faces.size() - rows.size()));
    run.dates.clear();
    run.operators.clear();
    run.rows_of_inputs.clear();
  }
  readings = select_rows(readings, rows);
  readings.has_fence = false;
}

void require_readings(const Run& run) {
  constexpr Eigen::Index fewest_of_log = 200;
  const Eigen::MatrixXd& response = run.observations.response;
  const Eigen::Index n = response.rows();
  if (n < fewest_of_log || has_poses(run.observations)) {
    return;
  }
  // Consecutive samples of a log are nearly equal. Consecutive readings in different orientations
  // differ strongly.
  const Eigen::VectorXd range = response.colwise().maxCoeff() - response.colwise().minCoeff();
  std::vector<double> steps;
  for (Eigen::Index i = 1; i < n; ++i) {
    steps.push_back((response.row(i) - response.row(i - 1)).norm());
  }
  constexpr double alike = 0.1;
  if (upper_median(std::move(steps)) < alike * range.maxCoeff()) {
    throw RefusedError(
        "these are samples of a moving instrument, without rests; let it rest for a second or more "
        "in each orientation, and find the rests with: axiscal segment LOG -o readings.csv");
  }
}

}  // namespace axiscal::cli

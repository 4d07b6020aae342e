// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "program.hpp"

namespace axiscal::test {

/// A simulated instrument of three axes: v = b + S f + noise.
struct StrangeInstrument {
  Eigen::Vector3d bias = {0.12, -0.2, 0.31};
  Eigen::Matrix3d sensitivity = (Eigen::Matrix3d() << 1.002,
                                 0.004,
                                 -0.003,  //
                                 0.002,
                                 0.998,
                                 0.005,  //
                                 -0.004,
                                 0.003,
                                 1.001)
                                    .finished();
  double noise = 0.002;
  std::mt19937_64 random{7};

  Eigen::Vector3d read(const Eigen::Vector3d& field) {
    std::normal_distribution<double> normal(0.0, noise);
    const Eigen::Vector3d e(normal(random), normal(random), normal(random));
    return bias + sensitivity * field + e;
  }

  /// @return a unit vector in a random direction.
  Eigen::Vector3d direction() {
    std::normal_distribution<double> normal;
    return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  }
};

inline constexpr double standard_gravity = 9.80665;

/// A seat of the standard design, and the direction of up in the cube's frame.
struct StrangeSeat {
  const char* rest;
  const char* fence;
  Eigen::Vector3d up;
};

/// The 12 seats: six faces, each in two headings that differ by 180 degrees.
[[nodiscard]] inline std::vector<StrangeSeat> twelve_seats() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  return {{"-Z", "+X", z}, {"-Z", "-X", z}, {"+Z", "+X", -z}, {"+Z", "-X", -z},
          {"-X", "+Y", x}, {"-X", "-Y", x}, {"+X", "+Y", -x}, {"+X", "-Y", -x},
          {"-Y", "+Z", y}, {"-Y", "-Z", y}, {"+Y", "+Z", -y}, {"+Y", "-Z", -y}};
}

[[nodiscard]] inline std::string row_text(const Eigen::Vector3d& v) {
  std::array<char, 128> text{};
  std::snprintf(text.data(), text.size(), "%.6f,%.6f,%.6f", v.x(), v.y(), v.z());
  return text.data();
}

/// CSV text of 12 readings in m/s^2 with the columns rest, fence, x, y, z.
[[nodiscard]] inline std::string twelve_readings(StrangeInstrument& instrument,
                                                 const std::string& more_names = "",
                                                 const std::string& more_cells = "") {
  std::string text = "rest,fence,x,y,z" + more_names + "\n";
  for (const StrangeSeat& seat : twelve_seats()) {
    text += std::string(seat.rest) + "," + seat.fence + "," +
            row_text(instrument.read(standard_gravity * seat.up)) + more_cells + "\n";
  }
  return text;
}

[[nodiscard]] inline nlohmann::json sensitivity_in(const nlohmann::json& record) {
  return record["coefficients"]["sensitivity"];
}

}  // namespace axiscal::test

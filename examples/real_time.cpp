// SPDX-License-Identifier: Apache-2.0
// Applies a calibration in a control loop. The constructor of Reducer allocates memory, but
// reduce() does not.
#include <array>
#include <atomic>
#include <axiscal/calib/reduction.hpp>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace {
std::atomic<long> allocations = 0;
}

// Counts the allocations, to show that the loop makes none.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) {
    return memory;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

int main() {
  // A real program would call axiscal::read_calibration("cal.json") instead.
  axiscal::Calibration calibration;
  calibration.sensor.instrument.kind = "accelerometer";
  calibration.sensor.field.kind = "gravity";
  calibration.sensor.field.unit = "g";
  calibration.sensor.response.bias = Eigen::Vector3d(0.01, -0.02, 0.005);
  calibration.sensor.response.sensitivity = 2.5 * Eigen::Matrix3d::Identity();

  const axiscal::Reducer reducer(calibration);
  const long before = allocations;
  axiscal::ReducedReading reduced;
  for (int tick = 0; tick < 1000; ++tick) {
    const std::array<double, 3> volts = {0.01 + 1e-3 * tick, -0.02, 2.4};
    reduced = reducer.reduce(volts);
  }
  const long allocated = allocations - before;
  std::printf("pitch %.3f deg, roll %.3f deg, | f | - F = %+.4f g; allocations: %ld\n",
              reduced["pitch_deg"], reduced["roll_deg"], reduced.residual, allocated);
  return 0;
}

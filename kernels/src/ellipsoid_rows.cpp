// SPDX-License-Identifier: Apache-2.0
#include "kernels/ellipsoid_rows.hpp"

#include <cmath>

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ellipsoid_rows.cpp"
#include "kernels/src/vector_lanes.hpp"
//
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace axiscal {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Computes the first rows, as many as fill whole SIMD vectors. @return the number of these rows.
std::size_t LineariseEllipsoid(const EllipsoidReadings& readings,
                               const EllipsoidWeights& weights,
                               const EllipsoidRows& rows) {
  const hn::CappedTag<double, 8> lanes;
  const std::size_t end = readings.n - readings.n % hn::Lanes(lanes);
  const auto one = hn::Set(lanes, 1.0);
  // Returns a x + b y + c z.
  const auto sum_of = [&](double a, auto x, double b, auto y, double c, auto z) {
    return hn::MulAdd(hn::Set(lanes, a), x,
                      hn::MulAdd(hn::Set(lanes, b), y, hn::Mul(hn::Set(lanes, c), z)));
  };
  const auto& A = readings.A;
  const auto& C = weights.C;
  for (std::size_t i = 0; i < end; i += hn::Lanes(lanes)) {
    const auto d0 = hn::Sub(hn::LoadU(lanes, readings.v[0] + i), hn::Set(lanes, readings.b[0]));
    const auto d1 = hn::Sub(hn::LoadU(lanes, readings.v[1] + i), hn::Set(lanes, readings.b[1]));
    const auto d2 = hn::Sub(hn::LoadU(lanes, readings.v[2] + i), hn::Set(lanes, readings.b[2]));
    auto u0 = sum_of(A[0][0], d0, A[0][1], d1, A[0][2], d2);
    auto u1 = sum_of(A[1][0], d0, A[1][1], d1, A[1][2], d2);
    auto u2 = sum_of(A[2][0], d0, A[2][1], d1, A[2][2], d2);
    const auto length = hn::Sqrt(hn::MulAdd(u0, u0, hn::MulAdd(u1, u1, hn::Mul(u2, u2))));
    const auto per_length = hn::Div(one, length);
    u0 = hn::Mul(u0, per_length);
    u1 = hn::Mul(u1, per_length);
    u2 = hn::Mul(u2, per_length);
    const auto Cu0 = sum_of(C[0][0], u0, C[0][1], u1, C[0][2], u2);
    const auto Cu1 = sum_of(C[1][0], u0, C[1][1], u1, C[1][2], u2);
    const auto Cu2 = sum_of(C[2][0], u0, C[2][1], u1, C[2][2], u2);
    const auto variance = hn::MulAdd(u0, Cu0, hn::MulAdd(u1, Cu1, hn::Mul(u2, Cu2)));
    const auto scale = hn::Div(hn::LoadU(lanes, weights.root_weights + i), hn::Sqrt(variance));
    hn::StoreU(scale, lanes, rows.scale + i);
    hn::StoreU(hn::Mul(scale, hn::Sub(length, one)), lanes, rows.residuals + i);
    u0 = hn::Mul(u0, scale);
    u1 = hn::Mul(u1, scale);
    u2 = hn::Mul(u2, scale);
    const auto& J = rows.jacobian;
    hn::StoreU(sum_of(-A[0][0], u0, -A[1][0], u1, -A[2][0], u2), lanes, J[0] + i);
    hn::StoreU(sum_of(-A[0][1], u0, -A[1][1], u1, -A[2][1], u2), lanes, J[1] + i);
    hn::StoreU(sum_of(-A[0][2], u0, -A[1][2], u1, -A[2][2], u2), lanes, J[2] + i);
    // If A is symmetric, the derivative with respect to A_jk includes the one with respect to A_kj.
    const auto other = hn::Set(lanes, weights.symmetric ? 1.0 : 0.0);
    hn::StoreU(hn::Mul(u0, d0), lanes, J[3] + i);
    hn::StoreU(hn::MulAdd(u0, d1, hn::Mul(other, hn::Mul(u1, d0))), lanes, J[4] + i);
    hn::StoreU(hn::MulAdd(u0, d2, hn::Mul(other, hn::Mul(u2, d0))), lanes, J[5] + i);
    hn::StoreU(hn::Mul(u1, d1), lanes, J[6] + i);
    hn::StoreU(hn::MulAdd(u1, d2, hn::Mul(other, hn::Mul(u2, d1))), lanes, J[7] + i);
    hn::StoreU(hn::Mul(u2, d2), lanes, J[8] + i);
  }
  return end;
}

// Returns the sum of (scale (|f| - 1))^2 over the first rows, as many as fill whole SIMD vectors.
// `end` receives the number of these rows.
double SumOfDeviations(const EllipsoidReadings& readings, const double* scale, std::size_t& end) {
  const hn::CappedTag<double, 8> lanes;
  end = readings.n - readings.n % hn::Lanes(lanes);
  const auto one = hn::Set(lanes, 1.0);
  auto sum = hn::Zero(lanes);
  for (std::size_t i = 0; i < end; i += hn::Lanes(lanes)) {
    const auto d0 = hn::Sub(hn::LoadU(lanes, readings.v[0] + i), hn::Set(lanes, readings.b[0]));
    const auto d1 = hn::Sub(hn::LoadU(lanes, readings.v[1] + i), hn::Set(lanes, readings.b[1]));
    const auto d2 = hn::Sub(hn::LoadU(lanes, readings.v[2] + i), hn::Set(lanes, readings.b[2]));
    auto squares = hn::Zero(lanes);
    for (const auto& row : readings.A) {
      const auto u =
          hn::MulAdd(hn::Set(lanes, row[0]), d0,
                     hn::MulAdd(hn::Set(lanes, row[1]), d1, hn::Mul(hn::Set(lanes, row[2]), d2)));
      squares = hn::MulAdd(u, u, squares);
    }
    const auto deviation = hn::Mul(hn::LoadU(lanes, scale + i), hn::Sub(hn::Sqrt(squares), one));
    sum = hn::MulAdd(deviation, deviation, sum);
  }
  return hn::GetLane(hn::SumOfLanes(lanes, sum));
}

}  // namespace HWY_NAMESPACE
}  // namespace axiscal
HWY_AFTER_NAMESPACE();
#else
#define HWY_ONCE 1
#endif

#if HWY_ONCE
namespace axiscal {
namespace {

// The vectors d = v - b and f = A d of a reading v, and the length |f|.
struct ReadingOfEllipsoid {
  std::array<double, 3> d;
  std::array<double, 3> f;
  double length;
};

ReadingOfEllipsoid reading_at(const EllipsoidReadings& readings, std::size_t i) {
  ReadingOfEllipsoid at{};
  for (std::size_t j = 0; j < 3; ++j) {
    at.d[j] = readings.v[j][i] - readings.b[j];
  }
  double squares = 0.0;
  for (std::size_t j = 0; j < 3; ++j) {
    const auto& row = readings.A[j];
    at.f[j] = row[0] * at.d[0] + row[1] * at.d[1] + row[2] * at.d[2];
    squares += at.f[j] * at.f[j];
  }
  at.length = std::sqrt(squares);
  return at;
}

void put_rows(const EllipsoidReadings& readings,
              const EllipsoidWeights& weights,
              const EllipsoidRows& rows,
              std::size_t first) {
  for (std::size_t i = first; i < readings.n; ++i) {
    const ReadingOfEllipsoid at = reading_at(readings, i);
    std::array<double, 3> u = at.f;
    for (double& part : u) {
      part /= at.length;
    }
    double variance = 0.0;
    for (std::size_t j = 0; j < 3; ++j) {
      const auto& row = weights.C[j];
      variance += u[j] * (row[0] * u[0] + row[1] * u[1] + row[2] * u[2]);
    }
    const double scale = weights.root_weights[i] / std::sqrt(variance);
    rows.scale[i] = scale;
    rows.residuals[i] = scale * (at.length - 1.0);
    for (double& part : u) {
      part *= scale;
    }
    std::size_t column = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const auto& A = readings.A;
      rows.jacobian[column++][i] = -(A[0][j] * u[0] + A[1][j] * u[1] + A[2][j] * u[2]);
    }
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = j; k < 3; ++k) {
        const bool stands_for_two = j != k && weights.symmetric;
        rows.jacobian[column++][i] = u[j] * at.d[k] + (stands_for_two ? u[k] * at.d[j] : 0.0);
      }
    }
  }
}

double squares_from(const EllipsoidReadings& readings, const double* scale, std::size_t first) {
  double sum = 0.0;
  for (std::size_t i = first; i < readings.n; ++i) {
    const double deviation = scale[i] * (reading_at(readings, i).length - 1.0);
    sum += deviation * deviation;
  }
  return sum;
}

}  // namespace

void ellipsoid_rows_plain(const EllipsoidReadings& readings,
                          const EllipsoidWeights& weights,
                          const EllipsoidRows& rows) {
  put_rows(readings, weights, rows, 0);
}

double ellipsoid_squares_plain(const EllipsoidReadings& readings, const double* scale) {
  return squares_from(readings, scale, 0);
}

#ifdef AXISCAL_HIGHWAY
AXISCAL_KERNEL(LineariseEllipsoid);
AXISCAL_KERNEL(SumOfDeviations);

void ellipsoid_rows(const EllipsoidReadings& readings,
                    const EllipsoidWeights& weights,
                    const EllipsoidRows& rows) {
  put_rows(readings, weights, rows, AXISCAL_CALL(LineariseEllipsoid)(readings, weights, rows));
}

double ellipsoid_squares(const EllipsoidReadings& readings, const double* scale) {
  std::size_t end = 0;
  const double sum = AXISCAL_CALL(SumOfDeviations)(readings, scale, end);
  return sum + squares_from(readings, scale, end);
}
#else
void ellipsoid_rows(const EllipsoidReadings& readings,
                    const EllipsoidWeights& weights,
                    const EllipsoidRows& rows) {
  ellipsoid_rows_plain(readings, weights, rows);
}

double ellipsoid_squares(const EllipsoidReadings& readings, const double* scale) {
  return ellipsoid_squares_plain(readings, scale);
}
#endif

}  // namespace axiscal
#endif

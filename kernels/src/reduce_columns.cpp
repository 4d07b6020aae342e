// SPDX-License-Identifier: Apache-2.0
#include "axiscal/kernels/reduce_columns.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reduce_columns.cpp"
#include "kernels/src/vector_lanes.hpp"
//
#include <hwy/foreach_target.h>
//
#include <hwy/cache_control.h>
#include <hwy/highway.h>
//
#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace axiscal {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<double, 8>;
using Double = hn::Vec<Lanes>;

// Results with at least this number of rows are written directly to memory and bypass the caches.
// In a normal write, the processor would read each cache line before overwriting it.
constexpr std::size_t streams_from = std::size_t{1} << 20U;

struct Affine {
  explicit Affine(const ColumnReduction& reduction) {
    const Lanes lanes;
    for (std::size_t i = 0; i < 3; ++i) {
      bias[i] = hn::Set(lanes, reduction.bias[i]);
    }
    for (std::size_t i = 0; i < 9; ++i) {
      inverse[i] = hn::Set(lanes, reduction.inverse[i]);
    }
  }

  HWY_INLINE Double row(std::size_t j, Double x, Double y, Double z) const {
    return hn::MulAdd(inverse[3 * j + 2], z,
                      hn::MulAdd(inverse[3 * j + 1], y, hn::Mul(inverse[3 * j], x)));
  }

  Double bias[3];
  Double inverse[9];
};

// atan2 with one division. It is correct for all arguments, also for +-0 and for two zeros.
HWY_INLINE Double ArcTangent(Double y, Double x) {
  const Lanes lanes;
  const Double ax = hn::Abs(x);
  const Double ay = hn::Abs(y);
  const Double low = hn::Min(ax, ay);
  const Double high = hn::Max(ax, ay);
  const Double zero = hn::Zero(lanes);
  // If `high` is 0 or NaN, the ratio is replaced by low + high, which is then also 0 or NaN.
  const Double ratio = hn::IfThenElse(hn::Gt(high, zero), hn::Div(low, high), hn::Add(low, high));
  Double angle = hn::Atan(lanes, ratio);
  angle =
      hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(lanes, std::numbers::pi / 2.0), angle), angle);
  const auto behind = hn::Lt(hn::CopySign(hn::Set(lanes, 1.0), x), zero);
  angle = hn::IfThenElse(behind, hn::Sub(hn::Set(lanes, std::numbers::pi), angle), angle);
  return hn::CopySign(angle, y);
}

template <bool with_angles>
void ReduceRange(const ColumnReduction& reduction,
                 const ReadColumns& v,
                 const WrittenColumns& f,
                 const AngleColumns& angles,
                 std::size_t rows) {
  const Lanes lanes;
  const Affine affine(reduction);
  const Double per_magnitude = hn::Set(lanes, 1.0 / reduction.magnitude);
  const Double one = hn::Set(lanes, 1.0);
  const auto put = [&](Double value, double* to) HWY_ATTR { hn::StoreU(value, lanes, to); };
  for (std::size_t i = 0; i < rows; i += hn::Lanes(lanes)) {
    const Double x = hn::Sub(hn::LoadU(lanes, v[0].data() + i), affine.bias[0]);
    const Double y = hn::Sub(hn::LoadU(lanes, v[1].data() + i), affine.bias[1]);
    const Double z = hn::Sub(hn::LoadU(lanes, v[2].data() + i), affine.bias[2]);
    const Double fx = affine.row(0, x, y, z);
    const Double fy = affine.row(1, x, y, z);
    const Double fz = affine.row(2, x, y, z);
    put(fx, f[0].data() + i);
    put(fy, f[1].data() + i);
    put(fz, f[2].data() + i);
    if constexpr (with_angles) {
      const Double sine = hn::Mul(fx, per_magnitude);
      const Double bounded = hn::Min(hn::Max(sine, hn::Neg(one)), one);
      const Double pitch = hn::Asin(lanes, bounded);
      put(hn::IfThenElse(hn::Eq(sine, sine), pitch, sine), angles.pitch_rad.data() + i);
      put(ArcTangent(fy, fz), angles.roll_rad.data() + i);
    }
  }
}

bool AreAligned(const WrittenColumns& f, const AngleColumns& angles, bool with_angles) {
  const std::size_t bytes = sizeof(double) * hn::Lanes(Lanes());
  const auto aligned = [&](const double* at) {
    return reinterpret_cast<std::uintptr_t>(at) % bytes == 0;
  };
  return aligned(f[0].data()) && aligned(f[1].data()) && aligned(f[2].data()) &&
         (!with_angles || (aligned(angles.pitch_rad.data()) && aligned(angles.roll_rad.data())));
}

// Converts 64 rows at a time into a buffer that stays in the cache. Then writes each column of the
// buffer in whole cache lines. If each row were written at once to the five columns, every cache
// line would be written in several parts.
template <bool with_angles>
void ReduceAndStream(const ColumnReduction& reduction,
                     const ReadColumns& v,
                     const WrittenColumns& f,
                     const AngleColumns& angles,
                     std::size_t rows) {
  constexpr std::size_t few = 64;
  alignas(64) double near[5][few];
  const WrittenColumns near_f = {std::span(near[0]), std::span(near[1]), std::span(near[2])};
  const AngleColumns near_angles{.pitch_rad = std::span(near[3]), .roll_rad = std::span(near[4])};
  const Lanes lanes;
  for (std::size_t first = 0; first < rows; first += few) {
    const std::size_t count = std::min(few, rows - first);
    ReduceRange<with_angles>(reduction,
                             {v[0].subspan(first), v[1].subspan(first), v[2].subspan(first)},
                             near_f, near_angles, count);
    const auto stream = [&](const double* from, double* to) HWY_ATTR {
      for (std::size_t i = 0; i < count; i += hn::Lanes(lanes)) {
        hn::Stream(hn::Load(lanes, from + i), lanes, to + first + i);
      }
    };
    for (std::size_t j = 0; j < 3; ++j) {
      stream(near[j], f[j].data());
    }
    if constexpr (with_angles) {
      stream(near[3], angles.pitch_rad.data());
      stream(near[4], angles.roll_rad.data());
    }
  }
  hwy::FlushStream();
}

// @return the number of rows that were computed, counted from the first row.
template <bool with_angles>
std::size_t Reduce(const ColumnReduction& reduction,
                   const ReadColumns& v,
                   const WrittenColumns& f,
                   const AngleColumns& angles) {
  const std::size_t whole = v[0].size() / hn::Lanes(Lanes()) * hn::Lanes(Lanes());
  const bool in_place = v[0].data() == f[0].data();
  if (whole >= streams_from && !in_place && AreAligned(f, angles, with_angles)) {
    ReduceAndStream<with_angles>(reduction, v, f, angles, whole);
  } else {
    ReduceRange<with_angles>(reduction, v, f, angles, whole);
  }
  return whole;
}

std::size_t ReduceComponents(const ColumnReduction& reduction,
                             const ReadColumns& v,
                             const WrittenColumns& f) {
  return Reduce<false>(reduction, v, f, {});
}

std::size_t ReduceWithAngles(const ColumnReduction& reduction,
                             const ReadColumns& v,
                             const WrittenColumns& f,
                             const AngleColumns& angles) {
  return Reduce<true>(reduction, v, f, angles);
}

std::size_t ReduceRows(const ColumnReduction& reduction,
                       const double* v,
                       std::size_t rows,
                       double* f) {
  const Lanes lanes;
  const Affine affine(reduction);
  const std::size_t whole = rows / hn::Lanes(lanes) * hn::Lanes(lanes);
  for (std::size_t i = 0; i < whole; i += hn::Lanes(lanes)) {
    Double x;
    Double y;
    Double z;
    hn::LoadInterleaved3(lanes, v + 3 * i, x, y, z);
    x = hn::Sub(x, affine.bias[0]);
    y = hn::Sub(y, affine.bias[1]);
    z = hn::Sub(z, affine.bias[2]);
    hn::StoreInterleaved3(affine.row(0, x, y, z), affine.row(1, x, y, z), affine.row(2, x, y, z),
                          lanes, f + 3 * i);
  }
  return whole;
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

std::array<double, 3> reduced(const ColumnReduction& reduction, double vx, double vy, double vz) {
  const std::array<double, 3> u = {vx - reduction.bias[0], vy - reduction.bias[1],
                                   vz - reduction.bias[2]};
  const std::array<double, 9>& A = reduction.inverse;
  return {A[0] * u[0] + A[1] * u[1] + A[2] * u[2], A[3] * u[0] + A[4] * u[1] + A[5] * u[2],
          A[6] * u[0] + A[7] * u[1] + A[8] * u[2]};
}

void reduce_rows_from(const ColumnReduction& reduction,
                      std::span<const double> v,
                      std::span<double> f,
                      std::size_t row) {
  for (std::size_t i = 3 * row; i + 2 < v.size(); i += 3) {
    const std::array<double, 3> field = reduced(reduction, v[i], v[i + 1], v[i + 2]);
    std::copy(field.begin(), field.end(), f.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

template <typename Columns>
Columns rest_of(Columns columns, std::size_t first) {
  for (auto& column : columns) {
    column = column.subspan(first);
  }
  return columns;
}

ReadColumns as_read(const WrittenColumns& columns) {
  return {columns[0], columns[1], columns[2]};
}

}  // namespace

void reduce_columns_plain(const ColumnReduction& reduction,
                          const ReadColumns& v,
                          const WrittenColumns& f) {
  for (std::size_t i = 0; i < v[0].size(); ++i) {
    const std::array<double, 3> field = reduced(reduction, v[0][i], v[1][i], v[2][i]);
    for (std::size_t j = 0; j < 3; ++j) {
      f[j][i] = field[j];
    }
  }
}

void add_angles_plain(const ColumnReduction& reduction,
                      const ReadColumns& field,
                      const AngleColumns& angles) {
  for (std::size_t i = 0; i < field[0].size(); ++i) {
    angles.pitch_rad[i] = std::asin(std::clamp(field[0][i] / reduction.magnitude, -1.0, 1.0));
    angles.roll_rad[i] = std::atan2(field[1][i], field[2][i]);
  }
}

#ifdef AXISCAL_HIGHWAY
AXISCAL_KERNEL(ReduceComponents);
AXISCAL_KERNEL(ReduceWithAngles);
AXISCAL_KERNEL(ReduceRows);

void reduce_columns(const ColumnReduction& reduction,
                    const ReadColumns& readings,
                    const WrittenColumns& field) {
  const std::size_t done = AXISCAL_CALL(ReduceComponents)(reduction, readings, field);
  reduce_columns_plain(reduction, rest_of(readings, done), rest_of(field, done));
}

void reduce_columns(const ColumnReduction& reduction,
                    const ReadColumns& readings,
                    const WrittenColumns& field,
                    const AngleColumns& angles) {
  const std::size_t done = AXISCAL_CALL(ReduceWithAngles)(reduction, readings, field, angles);
  const WrittenColumns rest = rest_of(field, done);
  reduce_columns_plain(reduction, rest_of(readings, done), rest);
  add_angles_plain(reduction, as_read(rest),
                   {angles.pitch_rad.subspan(done), angles.roll_rad.subspan(done)});
}

void reduce_rows(const ColumnReduction& reduction,
                 std::span<const double> readings,
                 std::span<double> field) {
  const std::size_t done =
      AXISCAL_CALL(ReduceRows)(reduction, readings.data(), readings.size() / 3, field.data());
  reduce_rows_from(reduction, readings, field, done);
}
#else
void reduce_columns(const ColumnReduction& reduction,
                    const ReadColumns& readings,
                    const WrittenColumns& field) {
  reduce_columns_plain(reduction, readings, field);
}

void reduce_columns(const ColumnReduction& reduction,
                    const ReadColumns& readings,
                    const WrittenColumns& field,
                    const AngleColumns& angles) {
  reduce_columns_plain(reduction, readings, field);
  add_angles_plain(reduction, as_read(field), angles);
}

void reduce_rows(const ColumnReduction& reduction,
                 std::span<const double> readings,
                 std::span<double> field) {
  reduce_rows_from(reduction, readings, field, 0);
}
#endif

}  // namespace axiscal
#endif

// SPDX-License-Identifier: Apache-2.0
// Reads MATLAB's .mat files of version 7.3, which are HDF5 files, with matio. Neither library is
// safe with damaged files: they do not check for failed allocations, and do not validate sizes.
#include <cstdint>
#include <matio.h>
#include <memory>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"
#include "logs/reader/formats.hpp"

namespace axiscal {
namespace {

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};

template <typename Number>
std::vector<double> doubles_of(const matvar_t& variable, std::size_t count) {
  const auto* const data = static_cast<const Number*>(variable.data);
  return std::vector<double>(data, data + count);
}

// @return the numbers of a variable; empty if it is not an array of real numbers.
std::vector<double> values_of(const matvar_t& variable, std::size_t count) {
  if (variable.isComplex != 0 || variable.data == nullptr ||
      variable.nbytes != count * static_cast<std::size_t>(variable.data_size)) {
    return {};
  }
  switch (variable.class_type) {
    case MAT_C_DOUBLE:
      return doubles_of<double>(variable, count);
    case MAT_C_SINGLE:
      return doubles_of<float>(variable, count);
    case MAT_C_INT64:
      return doubles_of<std::int64_t>(variable, count);
    case MAT_C_UINT64:
      return doubles_of<std::uint64_t>(variable, count);
    case MAT_C_INT32:
      return doubles_of<std::int32_t>(variable, count);
    case MAT_C_UINT32:
      return doubles_of<std::uint32_t>(variable, count);
    case MAT_C_INT16:
      return doubles_of<std::int16_t>(variable, count);
    case MAT_C_UINT16:
      return doubles_of<std::uint16_t>(variable, count);
    case MAT_C_INT8:
      return doubles_of<std::int8_t>(variable, count);
    case MAT_C_UINT8:
      return doubles_of<std::uint8_t>(variable, count);
    default:
      return {};
  }
}

// NOLINTNEXTLINE(misc-no-recursion): structures contain structures
void add_variable(const matvar_t& variable, const std::string& name, SeriesTables& tables) {
  if (variable.class_type == MAT_C_STRUCT) {
    const unsigned fields = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
    const char* const* const names = Mat_VarGetStructFieldnames(&variable);
    for (unsigned f = 0; f < fields; ++f) {
      const matvar_t* const field =
          Mat_VarGetStructFieldByIndex(const_cast<matvar_t*>(&variable), f, 0);
      if (field != nullptr) {
        add_variable(*field, formatted("{}.{}", name, names[f]), tables);
      }
    }
    return;
  }
  if (variable.rank != 2) {
    return;
  }
  const std::vector<double> values = values_of(variable, variable.dims[0] * variable.dims[1]);
  if (!values.empty()) {
    tables.add(name, variable.dims[0], variable.dims[1], values);
  }
}

// True if the numbers of a variable are missing although its sizes are not zero.
bool is_lost(const matvar_t& variable) {
  const bool is_numeric =
      variable.class_type >= MAT_C_DOUBLE && variable.class_type <= MAT_C_UINT64;
  std::size_t size = 1;
  for (int d = 0; d < variable.rank; ++d) {
    size *= variable.dims[d];
  }
  return is_numeric && size > 0 && variable.data == nullptr;
}

}  // namespace

SeriesTables read_mat73(const std::string& path) {
  refuse_foreign_storage(path);
  const std::unique_ptr<mat_t, CloseFile> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) {
    throw Error("the .mat file is damaged");
  }
  SeriesTables tables;
  std::size_t count = 0;
  char* const* const names = Mat_GetDir(file.get(), &count);
  for (std::size_t i = 0; i < count; ++i) {
    if (names[i] == nullptr) {
      continue;
    }
    // matio does not report a listed variable that it cannot read.
    const std::unique_ptr<matvar_t, FreeVariable> variable(Mat_VarRead(file.get(), names[i]));
    if (!variable || is_lost(*variable)) {
      throw Error(formatted("the .mat file is damaged: variable '{}' cannot be read", names[i]));
    }
    add_variable(*variable, names[i], tables);
  }
  return tables;
}

}  // namespace axiscal

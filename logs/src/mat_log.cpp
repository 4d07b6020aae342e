// SPDX-License-Identifier: Apache-2.0
// MATLAB's .mat files through matio: every numeric vector or matrix of the usual number of rows.
#include <cstdint>
#include <map>
#include <memory>

#ifdef AXISCAL_MATIO
#include <matio.h>
#endif

#include "axiscal/core/error.hpp"
#include "log_source.hpp"

namespace axiscal {

#ifdef AXISCAL_MATIO
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

// Empty for what is no array of real numbers.
std::vector<double> values_of(const matvar_t& variable, std::size_t count) {
  if (variable.isComplex != 0 || variable.data == nullptr) {
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

struct Table {
  std::vector<std::string> names;
  LogBlock data;
};

// A variable's columns; a row vector is one column.
void add_variable(const matvar_t& variable,
                  const std::string& name,
                  std::map<std::size_t, Table>& tables) {
  if (variable.class_type == MAT_C_STRUCT) {
    const unsigned fields = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
    const char* const* const names = Mat_VarGetStructFieldnames(&variable);
    for (unsigned f = 0; f < fields; ++f) {
      const matvar_t* const field =
          Mat_VarGetStructFieldByIndex(const_cast<matvar_t*>(&variable), f, 0);
      if (field != nullptr) {
        add_variable(*field, name + "." + names[f], tables);
      }
    }
    return;
  }
  if (variable.rank != 2) {
    return;
  }
  std::size_t rows = variable.dims[0];
  std::size_t columns = variable.dims[1];
  const std::vector<double> values = values_of(variable, rows * columns);
  if (values.empty()) {
    return;
  }
  if (rows < columns) {
    std::swap(rows, columns);  // a series along the second dimension
  }
  const bool transposed = variable.dims[0] != rows;
  Table& table = tables[rows];
  for (std::size_t c = 0; c < columns; ++c) {
    table.names.push_back(columns == 1 ? name : name + "_" + std::to_string(c + 1));
    std::vector<double>& column = table.data.emplace_back(rows);
    for (std::size_t r = 0; r < rows; ++r) {
      column[r] = transposed ? values[r * columns + c] : values[c * rows + r];
    }
  }
}

}  // namespace

std::unique_ptr<LogFile::Source> open_mat_log(const std::string& path) {
  if (path == "-") {
    throw DataError(path, "a .mat file cannot be read from standard input; give its name");
  }
  const std::unique_ptr<mat_t, CloseFile> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) {
    throw DataError(path, "the .mat file is damaged");
  }
  std::map<std::size_t, Table> tables;  // by number of rows
  for (;;) {
    const std::unique_ptr<matvar_t, FreeVariable> variable(Mat_VarReadNext(file.get()));
    if (!variable) {
      break;
    }
    if (variable->name != nullptr) {
      add_variable(*variable, variable->name, tables);
    }
  }
  // The table is what has the most numbers.
  const Table* best = nullptr;
  std::size_t most = 0;
  for (const auto& [rows, table] : tables) {
    if (rows * table.data.size() > most && rows > 1) {
      most = rows * table.data.size();
      best = &table;
    }
  }
  if (best == nullptr) {
    throw DataError(path, "the .mat file holds no column of numbers");
  }
  return std::make_unique<LogInMemory>(best->names, best->data);
}
#else
std::unique_ptr<LogFile::Source> open_mat_log(const std::string& path) {
  throw DataError(path, "is a .mat file, and this axiscal was built without matio; save it as CSV");
}
#endif

}  // namespace axiscal

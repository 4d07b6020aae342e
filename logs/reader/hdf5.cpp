// SPDX-License-Identifier: Apache-2.0
// Reads HDF5 files (The HDF Group): every numeric dataset of one or two dimensions, and the numeric
// members of compound datasets. Datasets with the same number of rows form one table. The HDF5
// library is not safe with damaged files.
#include <array>
#include <hdf5/serial/hdf5.h>
#include <vector>

#include "axiscal/core/error.hpp"
#include "logs/reader/formats.hpp"

namespace axiscal {
namespace {

// The first version of H5O_info_t, which HDF5 1.12 renamed to H5O_info1_t.
#if H5_VERSION_GE(1, 12, 0)
using ObjectInfo = H5O_info1_t;
#else
using ObjectInfo = H5O_info_t;
#endif

constexpr std::size_t most_numbers = std::size_t{1} << 30U;

// Owns an identifier of the HDF5 library, and closes it.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (id_ >= 0) {
      close_(id_);
    }
  }
  operator hid_t() const { return id_; }  // NOLINT(google-explicit-constructor): used as hid_t

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

// Replaces slashes by dots, so that the names are like those in other formats:
// "imu/accelerometer" becomes "imu.accelerometer".
std::string column_name(std::string name) {
  for (char& c : name) {
    c = c == '/' ? '.' : c;
  }
  return name;
}

bool is_number(hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  return kind == H5T_INTEGER || kind == H5T_FLOAT;
}

void add_numbers(hid_t dataset,
                 hid_t type,
                 const std::string& name,
                 std::size_t rows,
                 std::size_t columns,
                 SeriesTables& tables) {
  std::vector<double> values(rows * columns);
  if (H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    throw Error("the HDF5 file is damaged: dataset '" + name + "' cannot be read");
  }
  // H5Dread() gives the numbers row by row.
  std::vector<double> by_column(values.size());
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      by_column[c * rows + r] = values[r * columns + c];
    }
  }
  tables.add(column_name(name), rows, columns, by_column);
}

void add_dataset(hid_t dataset, const std::string& name, SeriesTables& tables) {
  const Handle space(H5Dget_space(dataset), H5Sclose);
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const int dimensions = H5Sget_simple_extent_ndims(space);
  std::array<hsize_t, 2> sizes = {1, 1};
  if (dimensions < 1 || dimensions > 2 ||
      H5Sget_simple_extent_dims(space, sizes.data(), nullptr) < 0 || sizes[0] == 0 ||
      sizes[1] == 0 || sizes[0] > most_numbers / sizes[1]) {
    return;
  }
  const auto rows = static_cast<std::size_t>(sizes[0]);
  const auto columns = static_cast<std::size_t>(sizes[1]);
  if (is_number(type)) {
    add_numbers(dataset, H5T_NATIVE_DOUBLE, name, rows, columns, tables);
    return;
  }
  if (H5Tget_class(type) != H5T_COMPOUND || dimensions != 1) {
    return;
  }
  const int members = H5Tget_nmembers(type);
  for (unsigned m = 0; m < static_cast<unsigned>(std::max(members, 0)); ++m) {
    const Handle member(H5Tget_member_type(type, m), H5Tclose);
    char* const member_name = H5Tget_member_name(type, m);
    if (member_name == nullptr) {
      continue;
    }
    const std::string own(member_name);
    if (is_number(member)) {
      const Handle wanted(H5Tcreate(H5T_COMPOUND, sizeof(double)), H5Tclose);
      H5Tinsert(wanted, member_name, 0, H5T_NATIVE_DOUBLE);
      add_numbers(dataset, wanted, own, rows, 1, tables);
    }
    H5free_memory(member_name);
  }
}

herr_t visit(hid_t place, const char* name, const ObjectInfo* info, void* to) {
  if (info->type == H5O_TYPE_DATASET) {
    const Handle dataset(H5Dopen2(place, name, H5P_DEFAULT), H5Dclose);
    if (dataset >= 0) {
      add_dataset(dataset, name, *static_cast<SeriesTables*>(to));
    }
  }
  return 0;
}

// Counts the datasets whose numbers are in other files.
herr_t visit_storage(hid_t place, const char* name, const ObjectInfo* info, void* count) {
  if (info->type != H5O_TYPE_DATASET) {
    return 0;
  }
  const Handle dataset(H5Dopen2(place, name, H5P_DEFAULT), H5Dclose);
  const Handle list(H5Dget_create_plist(dataset), H5Pclose);
  if (H5Pget_external_count(list) > 0 || H5Pget_layout(list) == H5D_VIRTUAL) {
    ++*static_cast<std::size_t*>(count);
  }
  return 0;
}

Handle open_alone(const std::string& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5Lunregister(H5L_TYPE_EXTERNAL);  // links to other files are not followed
  hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file < 0) {
    throw Error("the HDF5 file is damaged");
  }
  return {file, H5Fclose};
}

}  // namespace

void refuse_foreign_storage(const std::string& path) {
  const Handle file = open_alone(path);
  std::size_t count = 0;
  H5Ovisit1(file, H5_INDEX_NAME, H5_ITER_NATIVE, &visit_storage, &count);
  if (count > 0) {
    throw Error(
        "the file stores numbers in other files (external or virtual storage), which are not "
        "read; copy them into one file, for example with h5repack");
  }
}

SeriesTables read_hdf5(const std::string& path) {
  refuse_foreign_storage(path);
  const Handle file = open_alone(path);
  SeriesTables tables;
  H5Ovisit1(file, H5_INDEX_NAME, H5_ITER_NATIVE, &visit, &tables);
  return tables;
}

}  // namespace axiscal

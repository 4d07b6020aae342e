// SPDX-License-Identifier: Apache-2.0
#include "core/npy_header.hpp"

#include "core/formatted.hpp"

namespace axiscal {

std::string npy_header(const std::string& type, const std::string& shape, bool by_columns) {
  constexpr std::size_t longest_shape = 48;
  std::string header = formatted("{{'descr': {}, 'fortran_order': {}, 'shape': {:<{}}}}", type,
                                 by_columns ? "True" : "False", shape + ", ", longest_shape);
  constexpr std::size_t before = 10;  // bytes of magic number, version and header length
  header.append(64 - (before + header.size() + 1) % 64, ' ');
  header += '\n';
  std::string text = "\x93NUMPY";
  text += '\x01';
  text += '\0';
  text += static_cast<char>(header.size() % 256);
  text += static_cast<char>(header.size() / 256);
  return text + header;
}

}  // namespace axiscal

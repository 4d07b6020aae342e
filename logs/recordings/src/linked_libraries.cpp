// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/linked_libraries.hpp"

#ifdef AXISCAL_BZ2
#include <bzlib.h>
#endif
#ifdef AXISCAL_LZ4
#include <lz4.h>
#endif
#ifdef AXISCAL_LZMA
#include <lzma.h>
#endif
#ifdef AXISCAL_PUGIXML
#include <pugixml.hpp>
#endif
#ifdef AXISCAL_SQLITE
#include <sqlite3.h>
#endif
#ifdef AXISCAL_ZLIB
#include <zlib.h>
#endif
#ifdef AXISCAL_ZSTD
#include <zstd.h>
#endif

#include "core/formatted.hpp"

namespace axiscal {

std::vector<LinkedLibrary> linked_libraries() {
  LinkedLibrary bzip2{.name = "bzip2", .version = "", .reads = "bzip2, packed ROS 1 bags"};
  LinkedLibrary lz4{.name = "lz4", .version = "", .reads = "lz4, packed bags"};
  LinkedLibrary lzma{.name = "liblzma", .version = "", .reads = "xz, lzip"};
  LinkedLibrary minizip{.name = "minizip", .version = "", .reads = "zip, .npz, .xlsx"};
  LinkedLibrary pugixml{.name = "pugixml", .version = "", .reads = ".xlsx"};
  LinkedLibrary sqlite{.name = "sqlite", .version = "", .reads = "ROS 2 bags (.db3)"};
  LinkedLibrary zlib{.name = "zlib", .version = "", .reads = "gzip, compressed .mat"};
  LinkedLibrary zstd{.name = "zstd", .version = "", .reads = "zstd, packed bags"};
#ifdef AXISCAL_BZ2
  const std::string text = BZ2_bzlibVersion();  // "1.0.8, 13-Jul-2019"
  bzip2.version = text.substr(0, text.find(','));
#endif
#ifdef AXISCAL_LZ4
  lz4.version = LZ4_versionString();
#endif
#ifdef AXISCAL_LZMA
  lzma.version = lzma_version_string();
#endif
#ifdef AXISCAL_MINIZIP
  minizip.version = "present";  // minizip does not provide its version
#endif
#ifdef AXISCAL_PUGIXML
  pugixml.version = formatted("{}.{}", PUGIXML_VERSION / 1000, PUGIXML_VERSION % 1000 / 10);
#endif
#ifdef AXISCAL_SQLITE
  sqlite.version = sqlite3_libversion();
#endif
#ifdef AXISCAL_ZLIB
  zlib.version = zlibVersion();
#endif
#ifdef AXISCAL_ZSTD
  zstd.version = ZSTD_versionString();
#endif
  return {zlib, bzip2, lzma, lz4, zstd, minizip, pugixml, sqlite};
}

}  // namespace axiscal

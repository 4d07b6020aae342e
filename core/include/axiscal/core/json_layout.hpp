// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace axiscal {

/// How JSON text is laid out.
enum class JsonLayout {
  lines,    ///< each member on its own line, indented; the text ends with a line feed
  one_line  ///< no spaces and no line feeds, as in a file of JSON lines
};

}  // namespace axiscal

// SPDX-License-Identifier: Apache-2.0
// A PDF as an archive keeps it.
#pragma once

#include <string>

namespace axiscal {

struct PdfAttachment {
  std::string name;         ///< "certificate.xml"
  std::string description;  ///< for people
  std::string type;         ///< "text/xml"
  std::string content;
};

/// @param pdf         as cairo writes it: its fonts are within.
/// @param attachment  goes into the document; left out if its content is empty.
/// @return the document written to PDF/A-3b (ISO 19005-3): metadata as XMP, colours by sRGB, the
///         attachment as an associated file. The same document in a build without qpdf.
std::string archived_pdf(const std::string& pdf,
                         const std::string& title,
                         const PdfAttachment& attachment);

}  // namespace axiscal

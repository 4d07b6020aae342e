// SPDX-License-Identifier: Apache-2.0
// What qpdf does for an archive's PDF. This is C++17, as its source is.
#pragma once

#include <cstddef>

namespace axiscal {

/// What the module takes and gives is C's: it has a standard library of its own, which knows
/// neither the program's strings nor its exceptions.
struct PdfText {
  const char* data;
  std::size_t size;
};

/// What goes into an archive's PDF.
struct PdfArchiveParts {
  PdfText pdf;       ///< as cairo writes it: its fonts are within
  PdfText metadata;  ///< as XMP
  PdfText date;      ///< of the attachment, as PDF has it: "D:20261126020000Z"
  PdfText attachment_name;
  PdfText attachment_description;
  PdfText attachment_type;
  PdfText attachment_content;  ///< empty: there is none
};

/// @param to  what the caller gave.
using TakePdfText = void (*)(void* to, PdfText text) noexcept;

}  // namespace axiscal

/// Exported by the module with qpdf in it, where there is one. The loader knows it by its name
/// alone: whoever changes what it takes counts it up. No exception may cross, either way.
/// @param take  called once with `to` and the archive, or why there is none.
/// @return whether there is one.
extern "C" __attribute__((visibility("default"))) bool axiscal_archive_pdf_3(
    const axiscal::PdfArchiveParts* parts, axiscal::TakePdfText take, void* to) noexcept;

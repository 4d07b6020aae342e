// SPDX-License-Identifier: Apache-2.0
#include "report/src/pdf_archive.hpp"

#include <exception>

#if defined(AXISCAL_QPDF) || defined(AXISCAL_PDF_ARCHIVE_MODULE)
#include "axiscal/core/error.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"
#include "report/src/qpdf_archive.hpp"
#endif
#ifdef AXISCAL_PDF_ARCHIVE_MODULE
#include "core/late_module.hpp"
#endif

namespace axiscal {

#if defined(AXISCAL_QPDF) || defined(AXISCAL_PDF_ARCHIVE_MODULE)
namespace {

// What the document is, as XMP says it; nothing else says it too, so that nothing can differ.
std::string metadata_of(const std::string& title, const std::string& now) {
  return formatted(
      "<?xpacket begin=\"\xEF\xBB\xBF\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n"
      "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n"
      "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n"
      "<rdf:Description rdf:about=\"\" xmlns:pdfaid=\"http://www.aiim.org/pdfa/ns/id/\" "
      "xmlns:dc=\"http://purl.org/dc/elements/1.1/\" xmlns:xmp=\"http://ns.adobe.com/xap/1.0/\" "
      "xmlns:pdf=\"http://ns.adobe.com/pdf/1.3/\">\n"
      "<pdfaid:part>3</pdfaid:part><pdfaid:conformance>B</pdfaid:conformance>\n"
      "<dc:title><rdf:Alt><rdf:li xml:lang=\"x-default\">{}</rdf:li></rdf:Alt></dc:title>\n"
      "<xmp:CreatorTool>{}</xmp:CreatorTool><xmp:CreateDate>{}</xmp:CreateDate>"
      "<xmp:ModifyDate>{}</xmp:ModifyDate><pdf:Producer>cairo, qpdf</pdf:Producer>\n"
      "</rdf:Description></rdf:RDF></x:xmpmeta>\n<?xpacket end=\"r\"?>",
      escaped(title), software_name(), now, now);
}

}  // namespace

std::string archived_pdf(const std::string& pdf,
                         const std::string& title,
                         const PdfAttachment& attachment) {
#ifdef AXISCAL_PDF_ARCHIVE_MODULE
  static const auto archive = reinterpret_cast<decltype(&axiscal_archive_pdf_3)>(
      module_symbol(AXISCAL_PDF_ARCHIVE_MODULE, "axiscal_archive_pdf_3"));
#else
  constexpr auto archive = &axiscal_archive_pdf_3;
#endif
  const std::string now = timestamp_now();  // 2026-11-26T02:00:00Z
  const std::string date =
      formatted("D:{}{}{}{}{}{}Z", now.substr(0, 4), now.substr(5, 2), now.substr(8, 2),
                now.substr(11, 2), now.substr(14, 2), now.substr(17, 2));
  const std::string metadata = metadata_of(title, now);
  const auto text = [](const std::string& of) { return PdfText{of.data(), of.size()}; };
  const PdfArchiveParts parts{.pdf = text(pdf),
                              .metadata = text(metadata),
                              .date = text(date),
                              .attachment_name = text(attachment.name),
                              .attachment_description = text(attachment.description),
                              .attachment_type = text(attachment.type),
                              .attachment_content = text(attachment.content)};
  struct Taken {
    std::string text;
    std::exception_ptr error;
  } taken;
  const auto take = [](void* to, PdfText given) noexcept {
    Taken& all = *static_cast<Taken*>(to);
    try {
      all.text.assign(given.data, given.size);
    } catch (...) {  // no memory
      all.error = std::current_exception();
    }
  };
  const bool is_archived = archive(&parts, take, &taken);
  if (taken.error) {
    std::rethrow_exception(taken.error);
  }
  if (!is_archived) {
    throw OutputError("PDF: " + taken.text);
  }
  return taken.text;
}

#else

std::string archived_pdf(const std::string& pdf,
                         const std::string& /*title*/,
                         const PdfAttachment& /*attachment*/) {
  return pdf;
}

#endif

}  // namespace axiscal

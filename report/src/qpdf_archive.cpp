// SPDX-License-Identifier: Apache-2.0
// All that touches qpdf. Its headers (11) are C++17: clang 14 refuses them in C++20, for a vector
// of what is not yet complete. So this source is C++17 too, and includes nothing of ours that is
// not.
#include "report/src/qpdf_archive.hpp"

#include <cstring>
#include <exception>
#include <lcms2.h>
#include <memory>
#include <string>
#define POINTERHOLDER_TRANSITION 4  // qpdf's pointers are std::shared_ptr
#include <qpdf/Buffer.hh>
#include <qpdf/QPDF.hh>
#include <qpdf/QPDFEFStreamObjectHelper.hh>
#include <qpdf/QPDFEmbeddedFileDocumentHelper.hh>
#include <qpdf/QPDFFileSpecObjectHelper.hh>
#include <qpdf/QPDFWriter.hh>

namespace axiscal {
namespace {

std::string text_of(const PdfText& text) {
  return {text.data, text.size};
}

std::string srgb_profile() {
  const cmsHPROFILE profile = cmsCreate_sRGBProfile();
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string bytes(size, '\0');
  cmsSaveProfileToMem(profile, bytes.data(), &size);
  cmsCloseProfile(profile);
  return bytes;
}

void add_output_intent(QPDF& pdf, QPDFObjectHandle& root) {
  QPDFObjectHandle profile = QPDFObjectHandle::newStream(&pdf, srgb_profile());
  profile.getDict().replaceKey("/N", QPDFObjectHandle::newInteger(3));
  QPDFObjectHandle intent = QPDFObjectHandle::newDictionary();
  intent.replaceKey("/Type", QPDFObjectHandle::newName("/OutputIntent"));
  intent.replaceKey("/S", QPDFObjectHandle::newName("/GTS_PDFA1"));
  intent.replaceKey("/OutputConditionIdentifier", QPDFObjectHandle::newString("sRGB IEC61966-2.1"));
  intent.replaceKey("/Info", QPDFObjectHandle::newString("sRGB IEC61966-2.1"));
  intent.replaceKey("/DestOutputProfile", profile);
  QPDFObjectHandle all = QPDFObjectHandle::newArray();
  all.appendItem(pdf.makeIndirectObject(intent));
  root.replaceKey("/OutputIntents", all);
}

void attach(QPDF& pdf, QPDFObjectHandle& root, const PdfArchiveParts& parts) {
  const std::string name = text_of(parts.attachment_name);
  const std::string date = text_of(parts.date);
  auto stream = QPDFEFStreamObjectHelper::createEFStream(pdf, text_of(parts.attachment_content));
  stream.setSubtype(text_of(parts.attachment_type)).setCreationDate(date).setModDate(date);
  auto file = QPDFFileSpecObjectHelper::createFileSpec(pdf, name, stream);
  file.setDescription(text_of(parts.attachment_description));
  QPDFObjectHandle handle = file.getObjectHandle();
  handle.replaceKey("/AFRelationship", QPDFObjectHandle::newName("/Data"));
  QPDFEmbeddedFileDocumentHelper(pdf).replaceEmbeddedFile(name, file);
  QPDFObjectHandle associated = QPDFObjectHandle::newArray();
  associated.appendItem(handle);
  root.replaceKey("/AF", associated);
}

std::string archive(const PdfArchiveParts& parts) {
  QPDF pdf;
  pdf.processMemoryFile("certificate", parts.pdf.data, parts.pdf.size);
  QPDFObjectHandle root = pdf.getRoot();
  QPDFObjectHandle stream = QPDFObjectHandle::newStream(&pdf, text_of(parts.metadata));
  stream.getDict().replaceKey("/Type", QPDFObjectHandle::newName("/Metadata"));
  stream.getDict().replaceKey("/Subtype", QPDFObjectHandle::newName("/XML"));
  root.replaceKey("/Metadata", stream);
  root.replaceKey("/Lang", QPDFObjectHandle::newString("en"));
  add_output_intent(pdf, root);
  if (parts.attachment_content.size > 0) {
    attach(pdf, root, parts);
  }
  pdf.getTrailer().removeKey("/Info");
  QPDFWriter writer(pdf);
  writer.setOutputMemory();
  writer.setMinimumPDFVersion("1.7");
  writer.setCompressStreams(true);
  writer.setObjectStreamMode(qpdf_o_disable);
  writer.setPreserveUnreferencedObjects(false);
  writer.write();
  const std::unique_ptr<Buffer> buffer(writer.getBuffer());
  return {reinterpret_cast<const char*>(buffer->getBuffer()), buffer->getSize()};
}

}  // namespace
}  // namespace axiscal

bool axiscal_archive_pdf_3(const axiscal::PdfArchiveParts* parts,
                           axiscal::TakePdfText take,
                           void* to) noexcept {
  std::string archived;
  try {
    archived = axiscal::archive(*parts);
  } catch (const std::exception& error) {
    take(to, {error.what(), std::strlen(error.what())});
    return false;
  } catch (...) {
    const char* const why = "unknown";
    take(to, {why, std::strlen(why)});
    return false;
  }
  take(to, {archived.data(), archived.size()});
  return true;
}

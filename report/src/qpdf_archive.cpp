// SPDX-License-Identifier: Apache-2.0
// All code that uses qpdf. Clang 14 rejects the headers of qpdf 11 in C++20 (a vector of an
// incomplete type), so this file is compiled as C++17. It may include only headers that are valid
// C++17.
#include "report/src/qpdf_archive.hpp"

#include <lcms2.h>
#include <memory>
#include <string>
#define POINTERHOLDER_TRANSITION 4  // qpdf then uses std::shared_ptr
#include <qpdf/Buffer.hh>
#include <qpdf/QPDF.hh>
#include <qpdf/QPDFEFStreamObjectHelper.hh>
#include <qpdf/QPDFEmbeddedFileDocumentHelper.hh>
#include <qpdf/QPDFFileSpecObjectHelper.hh>
#include <qpdf/QPDFWriter.hh>

namespace axiscal {
namespace {

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
  auto stream = QPDFEFStreamObjectHelper::createEFStream(pdf, parts.attachment_content);
  stream.setSubtype(parts.attachment_type).setCreationDate(parts.date).setModDate(parts.date);
  auto file = QPDFFileSpecObjectHelper::createFileSpec(pdf, parts.attachment_name, stream);
  file.setDescription(parts.attachment_description);
  QPDFObjectHandle handle = file.getObjectHandle();
  handle.replaceKey("/AFRelationship", QPDFObjectHandle::newName("/Data"));
  QPDFEmbeddedFileDocumentHelper(pdf).replaceEmbeddedFile(parts.attachment_name, file);
  QPDFObjectHandle associated = QPDFObjectHandle::newArray();
  associated.appendItem(handle);
  root.replaceKey("/AF", associated);
}

}  // namespace

std::string pdf_archive_of(const PdfArchiveParts& parts) {
  QPDF pdf;
  pdf.processMemoryFile("certificate", parts.pdf.data(), parts.pdf.size());
  QPDFObjectHandle root = pdf.getRoot();
  QPDFObjectHandle stream = QPDFObjectHandle::newStream(&pdf, parts.metadata);
  stream.getDict().replaceKey("/Type", QPDFObjectHandle::newName("/Metadata"));
  stream.getDict().replaceKey("/Subtype", QPDFObjectHandle::newName("/XML"));
  root.replaceKey("/Metadata", stream);
  root.replaceKey("/Lang", QPDFObjectHandle::newString("en"));
  add_output_intent(pdf, root);
  if (!parts.attachment_content.empty()) {
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

}  // namespace axiscal

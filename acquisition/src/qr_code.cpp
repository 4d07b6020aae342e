// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/web_face.hpp"

#ifdef AXISCAL_QRENCODE
#include <qrencode.h>

#endif

namespace axiscal {

std::string qr_code(const std::string& text) {
  std::string drawn;
#ifdef AXISCAL_QRENCODE
  std::unique_ptr<QRcode, void (*)(QRcode*)> code(nullptr, nullptr);
  try {
    code = {QRcode_encodeString(text.c_str(), 0, QR_ECLEVEL_M, QR_MODE_8, 1), QRcode_free};
  } catch (const RefusedError&) {
    return drawn;  // without the library, only the address is printed
  }
  if (!code) {
    return drawn;
  }
  constexpr int border = 2;
  const auto is_light = [&](int x, int y) {
    return x < 0 || y < 0 || x >= code->width || y >= code->width ||
           (code->data[y * code->width + x] & 1U) == 0;
  };
  // Draws the light modules, so that the code is readable on a dark terminal.
  for (int y = -border; y < code->width + border; y += 2) {
    for (int x = -border; x < code->width + border; ++x) {
      const bool above = is_light(x, y);
      const bool below = is_light(x, y + 1);
      drawn += above && below ? "\u2588" : above ? "\u2580" : below ? "\u2584" : " ";
    }
    drawn += "\n";
  }
#else
  static_cast<void>(text);
#endif
  return drawn;
}

}  // namespace axiscal

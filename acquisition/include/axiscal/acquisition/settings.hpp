// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/setting.hpp"

/// The settings of a session.
namespace axiscal::settings {

inline constexpr Setting journal{"session.journal"};   ///< the file that it writes
inline constexpr Setting resume{"session.resume"};     ///< a journal to go on with
inline constexpr Setting plain_face{"session.plain"};  ///< in plain lines
inline constexpr Setting web_face{"session.web"};      ///< in a browser
inline constexpr Setting ports{"session.ports"};       ///< a list of connected devices

}  // namespace axiscal::settings

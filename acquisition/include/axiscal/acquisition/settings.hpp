// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/setting.hpp"

/// The settings of a session.
namespace axiscal::settings {

inline constexpr Setting journal{"session.journal"};   ///< name of the journal file to write
inline constexpr Setting resume{"session.resume"};     ///< journal of the session to resume
inline constexpr Setting plain_face{"session.plain"};  ///< user interface in plain text lines
inline constexpr Setting web_face{"session.web"};      ///< user interface in a browser
inline constexpr Setting ports{"session.ports"};       ///< list of connected devices

}  // namespace axiscal::settings

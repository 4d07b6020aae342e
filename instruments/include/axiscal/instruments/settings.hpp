// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/setting.hpp"

/// The settings of an instrument.
namespace axiscal::settings {

inline constexpr Setting instrument{"instrument.kind"};
inline constexpr Setting axes{"instrument.axes"};
inline constexpr Setting range{"instrument.range"};

}  // namespace axiscal::settings

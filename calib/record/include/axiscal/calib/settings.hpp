// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/setting.hpp"

/// The options of an experiment besides its field and its instrument.
namespace axiscal::settings {

inline constexpr Setting each{"each"};  ///< a record of each file
inline constexpr Setting from_record{"from"};
inline constexpr Setting gyroscope_scale{"turns.rate_per_unit"};
inline constexpr Setting leave_out{"leave_out"};  ///< readings, or slots
inline constexpr Setting method{"method"};
inline constexpr Setting polar_fit{"polar_fit"};
inline constexpr Setting serial{"instrument.serial"};
inline constexpr Setting temperature_order{"temperature.order"};
inline constexpr Setting run_sheet{"run_sheet"};    ///< in which order the points were taken
inline constexpr Setting laboratory{"laboratory"};  ///< CertificateDetails

}  // namespace axiscal::settings

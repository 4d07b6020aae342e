// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/setting.hpp"

/// The options of an experiment, except those of its field and its instrument.
namespace axiscal::settings {

inline constexpr Setting each{"each"};  ///< one record for each file of readings
inline constexpr Setting from_record{"from"};
inline constexpr Setting gyroscope_scale{"turns.rate_per_unit"};
inline constexpr Setting leave_out{"leave_out"};  ///< readings or slots that are not used
inline constexpr Setting method{"method"};
inline constexpr Setting polar_fit{"polar_fit"};
inline constexpr Setting serial{"instrument.serial"};
inline constexpr Setting temperature_order{"temperature.order"};
inline constexpr Setting run_sheet{"run_sheet"};    ///< the order of the design points
inline constexpr Setting laboratory{"laboratory"};  ///< CertificateDetails

}  // namespace axiscal::settings

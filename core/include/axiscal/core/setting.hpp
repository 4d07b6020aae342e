// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace axiscal {

/// What a user can state, of all that the library asks for. An error carries the settings that
/// would mend it, and a program makes its own names of them: the command its options, a dialogue
/// its fields.
enum class Setting {
  axes,                ///< Instrument::axes
  column_names,        ///< what a log's columns are called
  date,                ///< FieldSetup::date
  fence_azimuth,       ///< Experiment::fence_azimuth_rad
  field,               ///< FieldPart::kind
  field_magnitude,     ///< FieldPart::magnitude
  field_magnitude_u,   ///< FieldPart::magnitude_u
  field_table,         ///< FieldPart::in_table
  from_record,         ///< Experiment::from
  gyroscope_scale,     ///< TurnFitOptions::rate_per_unit
  instrument,          ///< Instrument::kind
  imported_magnitude,  ///< ImportOptions::magnitude
  journal,             ///< the file that a session writes
  laboratory,          ///< CertificateDetails
  leave_out,           ///< Experiment::leave_out, or slots
  local_gravity,       ///< ExportOptions::local_gravity
  log,                 ///< a raw log instead of observations
  longitude,           ///< of FieldSetup::site
  lossy,               ///< ExportOptions::lossy
  magnetic_model,      ///< FieldPart::model
  method,              ///< Experiment::method
  numbers,             ///< ExportOptions::numbers
  plain_face,          ///< a session in plain lines
  polar_fit,           ///< Experiment::compare_polar_fit
  ports,               ///< a list of what is connected
  range,               ///< Instrument::range
  rate,                ///< SegmentOptions::rate_hz
  reading_factor,      ///< ExportOptions::reading_factor
  resume,              ///< a journal to go on with
  run_sheet,           ///< in which order the points were taken
  shortest_rest,       ///< SegmentOptions::shortest_s
  site,                ///< FieldSetup::site: latitude, and what else of it is asked for
  slope,               ///< Experiment::slope
  temperature_order,   ///< TemperatureSetup::order
  time_column,         ///< SegmentOptions::time
  web_face,            ///< a session in a browser
};

}  // namespace axiscal

// SPDX-License-Identifier: Apache-2.0
#include "command_line.hpp"

#include <algorithm>

#include <CLI/CLI.hpp>

#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/version.hpp"
#include "definition.hpp"

namespace axiscal::cli {
namespace {

// An option whose value is kept as typed.
CLI::Option* add_text(CLI::App& app,
                      const char* name,
                      std::optional<std::string>& value,
                      const char* type,
                      const char* help) {
  return app.add_option(name, value, help)->type_name(type);
}

void add_files(CLI::App& app, ExperimentOptions& options) {
  app.add_option("files", options.files,
                 "Observations (CSV, several are blocks) or one experiment (.json); - is stdin")
      ->required()
      ->type_name("FILE");
}

void add_experiment_options(CLI::App& app, ExperimentOptions& options) {
  const auto add = [&app](const char* group, const char* name, std::optional<std::string>& value,
                          const char* type, const char* help) {
    add_text(app, name, value, type, help)->group(group);
  };
  add("Instrument", "--instrument", options.instrument, "KIND",
      "accelerometer, inclinometer, magnetometer, gyroscope, optical or generic");
  add("Instrument", "--serial", options.serial, "TEXT", "serial number");
  add("Instrument", "--axes", options.axes, "A,B,..",
      "response columns, one or more; x,y,z; d=p-n is an axis d, the difference of two columns");
  add("Instrument", "--range", options.range, "LO,HI",
      "readings at or beyond these are left out for their axis (saturated)");
  app.add_flag("--one-sided", options.one_sided,
               "axes that see only what comes from in front of them (photodiodes)")
      ->group("Instrument");
  add("Instrument", "--unit", options.unit, "UNIT", "unit of the readings; 1");
  add("Instrument", "--nominal-sensitivity", options.nominal_sensitivity, "S",
      "what the axes' sensitivities should be: mistakes in a whole run show against it");
  add("Instrument", "--convention", options.convention, "flu|frd",
      "axes forward-left-up (default) or forward-right-down");
  add("Field", "--field", options.field, "KIND",
      "gravity, geomagnetic, earth_rotation, induced_rotation, induced_magnetic, light or custom; "
      "KIND+KIND is a sum, of which unit, magnitude and vector are those of the induced part");
  add("Field", "--also", options.also, "KIND",
      "a second field that it answers to, known in the table (a gyroscope's g-sensitivity)");
  add("Field", "--field-unit", options.field_unit, "UNIT",
      "g (default), m/s^2; nT, uT, T; rad/s, deg/s, deg/h; 1, W/m^2");
  add("Field", "--field-magnitude", options.field_magnitude, "F", "its magnitude, in its unit");
  add("Field", "--field-magnitude-u", options.field_magnitude_u, "U",
      "standard uncertainty of --field-magnitude");
  add("Field", "--field-table", options.field_table, "X,Y,Z", "the field in the table's frame");
  add("Field", "--latitude", options.latitude, "DEG", "of the site");
  add("Field", "--longitude", options.longitude, "DEG", "of the site; 0");
  add("Field", "--height", options.height, "M", "of the site above the ellipsoid; 0");
  add("Field", "--date", options.date, "DATE", "ISO 8601 or decimal year; today");
  add("Field", "--magnetic-model", options.magnetic_model, "NAME",
      "wmm2025 (built in), or one installed for GeographicLib");
  add("Field", "--gravity-model", options.gravity_model, "NAME",
      "wgs84 (built in), or one installed for GeographicLib");
  add("Field", "--source", options.source, "sun|lamp",
      "of light; the sun's place at each reading's time");
  add("Table and cube", "--fence-azimuth", options.fence_azimuth, "DEG",
      "azimuth of the table's y axis, clockwise from north; 0, by joint as the readings show");
  add("Table and cube", "--slope", options.slope, "X,Y", "known slope of the table; 0,0");
  add("Table and cube", "--positioner", options.positioner, "FILE",
      "measured cube; the nominal one");
  add("Table and cube", "--slot", options.slot, "NAME",
      "mount of the positioner that holds the instrument");
  add("Table and cube", "--assembly", options.assembly, "NAME",
      "mounts of the slots of columns SLOT.axis: parallel, single, triple (all as the cube), h or "
      "h:y "
      "(two on the web of an H, the second turned by 180 degrees about x or y)");
  add("Method", "--method", options.method, "METHOD",
      "paired, joint, known or magnitude (no labels), chosen by the data; bias: at rest in one "
      "pose, "
      "over temperature");
  add("Method", "--shape", options.shape, "SHAPE",
      "magnitude: symmetric (default) or triangular sensitivity");
  add("Method", "--weights", options.weights, "W",
      "samples (default where the column is there), sd or none");
  app.add_flag("--robust", options.robust, "bisquare regression")->group("Method");
  app.add_flag("--polar-fit", options.polar_fit,
               "fit the known-art form (coning angle, azimuth) by Gauss-Newton too, to compare")
      ->group("Method");
  add("Method", "--leave-out", options.leave_out, "RUNS", "runs not to use, e.g. 7,8");
  add("Method", "--noise-ratio", options.noise_ratio, "A,B,..",
      "how the noise of the axes compares (1,1,1: equal); mistakes are then seen better");
  add("Method", "--level-by", options.level_by, "run|block",
      "one levelness for the run (default) or one for each block");
  add("Method", "--temperature-order", options.temperature_order, "N",
      "of bias and scale over the column 'temperature': 0 (default), 1, 2 or auto; bias: any");
  add("Method", "--temperature-reference", options.temperature_reference, "T",
      "where the coefficients are stated; mean of the readings");
  add("Method", "--from", options.from, "RECORD", "bias: the record that has the sensitivity");
  add("Uncertainty", "--resolution", options.resolution, "Q", "smallest step of a reading");
  add("Uncertainty", "--slope-u", options.slope_u, "RAD",
      "known: standard uncertainty of the slope, x and y");
  add("Uncertainty", "--direction-u", options.direction_u, "RAD",
      "known: standard uncertainty of the field's direction");
  add("Uncertainty", "--temperature-u", options.temperature_u, "U",
      "standard uncertainty of the temperature output");
}

void add_sheet_options(CLI::App& app, SheetOptions& options) {
  app.add_option("--design", options.design,
                 "6, 12 (default) or 24 points, the N of the 24 that determine most, or a file")
      ->type_name("6|12|24|optimal:N|FILE");
  app.add_option("--replicates", options.replicates, "how often the whole design is taken; 1")
      ->type_name("N");
  app.add_option("--seed", options.seed, "of the random order; 1")->type_name("S");
  app.add_option("--temperatures", options.temperatures,
                 "soak levels, one after another: all replicates at each")
      ->type_name("T,T,..");
}

void add_output(CLI::App& app, std::string& output) {
  app.add_option("-o,--output", output, "where to write; - is stdout")->type_name("FILE");
}

void add_log_options(CLI::App& app, LogOptions& options) {
  const auto add = [&app](const char* name, std::optional<std::string>& value, const char* type,
                          const char* help) {
    add_text(app, name, value, type, help)->group("Log");
  };
  add("--time", options.time, "COLUMN", "of times; time, t, timestamp with _s, _ms, _us, _ns");
  add("--rate", options.rate, "HZ", "samples a second, instead of a column of times");
  add("--names", options.names, "A,B,..", "names of the columns of a log without a header");
  add("--map", options.map, "FILE", "axiscal-log (JSON): columns renamed, scaled, turned round");
}

void add_rest_options(CLI::App& app, RestOptions& options) {
  const auto add = [&app](const char* name, std::optional<std::string>& value, const char* type,
                          const char* help) {
    add_text(app, name, value, type, help)->group("Log");
  };
  add_log_options(app, options.log);
  add("--columns", options.columns, "A,B,..",
      "columns whose variance tells rest from motion; segment: --accelerometer, or x,y,z; "
      "calibrate: "
      "the gyroscope's, or the accelerometer's");
  add("--window", options.window, "S",
      "of the sliding variance, half of which is left out at both ends of a rest; 0.5");
  add("--min-length", options.shortest, "S", "what is left of a rest is at least so long; 1");
  add("--trim", options.trim, "S", "left out besides at both ends; 0.1");
  add("--threshold", options.threshold, "V",
      "rest is where the joined variance is below it; chosen from the data");
  add("--plan", options.plan, "SHEET", "run sheet: the seats of a cube, in its order");
  add("--first-fence", options.first_fence, "FACE",
      "the first rest's face at the fence, where seats are recognised");
  add("--accelerometer", options.accelerometer, "X,Y,Z", "columns; ax,ay,az");
  add("--gyroscope", options.gyroscope, "X,Y,Z", "columns; calibrate: gx,gy,gz if there are such");
  add("--magnetometer", options.magnetometer, "X,Y,Z",
      "columns; calibrate: mx,my,mz if there are such");
  add("--gyroscope-scale", options.gyroscope_scale, "RATE",
      "rad/s per unit of the gyroscope, roughly; found among the usual ones");
}

// The option that an argument names, with or without its value; null where there is none.
CLI::Option* find_option(CLI::App& app, const std::string& argument) {
  return app.get_option_no_throw(argument.substr(0, argument.find('=')));
}

// Joins an option and its value, as values may start with a minus sign, and refuses unknown ones.
std::vector<std::string> with_joined_values(CLI::App& app,
                                            const std::vector<std::string>& arguments) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    std::string argument = arguments[i];
    if (argument.starts_with("--") && argument.size() > 2) {
      const CLI::Option* option = find_option(app, argument);
      if (option == nullptr) {
        std::vector<std::string> names;
        for (const CLI::Option* known : app.get_options()) {
          if (!known->get_lnames().empty()) {
            names.push_back("--" + known->get_lnames().front());
          }
        }
        const std::vector<std::string_view> views(names.begin(), names.end());
        const std::string name = argument.substr(0, argument.find('='));
        throw UsageError("unknown option '" + name + "'" + did_you_mean(name, views));
      }
      const bool takes_value = option->get_items_expected_min() > 0;
      const bool has_value = argument.find('=') != std::string::npos;
      const bool next_is_value =
          i + 1 < arguments.size() &&
          !(arguments[i + 1].starts_with("-") && find_option(app, arguments[i + 1]) != nullptr);
      if (takes_value && !has_value && next_is_value) {
        argument += "=" + arguments[++i];
      }
      if (takes_value && argument.ends_with("=")) {
        throw UsageError(argument.substr(0, argument.size() - 1) + ": its value is empty");
      }
    }
    if (argument == "-o" && i + 1 < arguments.size() && arguments[i + 1].empty()) {
      throw UsageError("-o: its value is empty");
    }
    result.push_back(argument);
  }
  return result;
}

OptionDefinition definition_of(const CLI::Option& option) {
  OptionDefinition definition{.names = {},
                              .type = "",
                              .help = option.get_description(),
                              .is_argument = option.get_positional()};
  for (const std::string& name : option.get_snames()) {
    definition.names.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    definition.names.push_back("--" + name);
  }
  if (definition.is_argument) {
    definition.names = {option.get_single_name()};
  }
  if (option.get_items_expected_max() > 0) {
    definition.type = option.get_type_name();
  }
  return definition;
}

ProgramDefinition definition_of(const CLI::App& app) {
  ProgramDefinition program{.name = app.get_name(),
                            .version = std::string(software_name()),
                            .help = app.get_description(),
                            .subcommands = {}};
  for (const CLI::App* subcommand : app.get_subcommands(nullptr)) {
    SubcommandDefinition& definition = program.subcommands.emplace_back();
    definition.name = subcommand->get_name();
    definition.help = subcommand->get_description();
    definition.footer = subcommand->get_footer();
    for (const CLI::Option* option : subcommand->get_options()) {
      definition.options.push_back(definition_of(*option));
    }
  }
  return program;
}

}  // namespace

Command parse_command_line(std::vector<std::string> arguments) {
  CLI::App app("Axiscal calibrates axis-sensitive instruments in 12 orientations.", "axiscal");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string(software_name()), "Print the version and exit");
  app.get_formatter()->column_width(28);
  app.footer("axiscal SUBCOMMAND --help tells more of each.");

  FieldCommand field;
  CLI::App* field_app =
      app.add_subcommand("field", "gravity, geomagnetic field, Earth rotation and sun at a site");
  field_app->footer(
      "Example: axiscal field --latitude 48.14 --longitude 11.58 --height 520 --date 2026-06-21");
  add_text(*field_app, "--latitude", field.latitude, "DEG", "geodetic, north positive");
  add_text(*field_app, "--longitude", field.longitude, "DEG", "east positive");
  add_text(*field_app, "--height", field.height, "M", "above the WGS 84 ellipsoid; 0");
  add_text(*field_app, "--date", field.date, "DATE", "ISO 8601 (UTC) or decimal year; now");
  add_text(*field_app, "--only", field.only, "NAMES",
           "some of gravity,geomagnetic,earth_rotation,sun");
  add_text(*field_app, "--magnetic-model", field.magnetic_model, "NAME",
           "wmm2025 (built in), or one installed for GeographicLib (igrf14)");
  add_text(*field_app, "--gravity-model", field.gravity_model, "NAME",
           "wgs84 (built in), or one installed for GeographicLib (egm96, egm2008)");
  field_app->add_flag("--refraction", field.refraction, "the sun as the air lifts it");
  add_output(*field_app, field.output);
  field_app->add_flag("--json", field.json, "print JSON instead of a table");

  CalibrateCommand calibrate;
  CLI::App* calibrate_app = app.add_subcommand("calibrate", "observations -> calibration record");
  calibrate_app->footer(
      "Example: axiscal calibrate run.csv --instrument accelerometer --field gravity --unit V "
      "-o cal.json");
  calibrate_app
      ->add_option("files", calibrate.experiment.files,
                   "Observations (CSV, several are blocks) or one experiment (.json); - is stdin")
      ->type_name("FILE");
  add_experiment_options(*calibrate_app, calibrate.experiment);
  calibrate_app->add_option("-o,--output", calibrate.output, "the record (JSON); - is stdout")
      ->type_name("FILE");
  calibrate_app
      ->add_option("--align", calibrate.align,
                   "record of a three-axis instrument in the same file: its frame is taken over")
      ->type_name("RECORD");
  calibrate_app->add_flag("--json", calibrate.json, "print the record instead of tables");
  add_text(*calibrate_app, "--imu", calibrate.imu, "LOG",
           "a raw log of rests and turns instead of observations: accelerometer, gyroscope and "
           "magnetometer at once; -o holds {slot}")
      ->group("Log");
  add_rest_options(*calibrate_app, calibrate.rests);
  calibrate_app
      ->add_flag("--cube", calibrate.cube,
                 "it sat in a cube: the seats are recognised; else it was turned by hand")
      ->group("Log");
  calibrate_app
      ->add_flag("--fit-gyroscope-bias", calibrate.fit_gyroscope_bias,
                 "by the turns, not by the rests: for a bias that wanders")
      ->group("Log");
  add_text(*calibrate_app, "--gyroscope-unit", calibrate.gyroscope_unit, "UNIT",
           "of the gyroscope's readings; --unit is the accelerometer's")
      ->group("Log");
  add_text(*calibrate_app, "--magnetometer-unit", calibrate.magnetometer_unit, "UNIT",
           "of the magnetometer's readings")
      ->group("Log");
  add_text(*calibrate_app, "--magnetic-magnitude", calibrate.magnetic_magnitude, "F",
           "of the local magnetic field [nT]; by --latitude and --longitude, or 1")
      ->group("Log");
  add_text(*calibrate_app, "--limits", calibrate.limits, "FILE",
           "accept or reject by these limits; rejected: exit 1");
  add_text(*calibrate_app, "--table", calibrate.table, "FILE",
           "of many units (column 'serial'): one row each, with verdict and reason");
  calibrate_app->add_flag(
      "--accept-suggestion", calibrate.accept_suggestion,
      "correct, or leave out, what is most likely a mistake; the record says so");
  calibrate_app->add_flag("--force", calibrate.force, "store the record even if it is refused");

  SegmentCommand segment;
  CLI::App* segment_app =
      app.add_subcommand("segment", "raw log -> static positions as observations");
  segment_app->footer(
      "Example: axiscal segment log.csv --columns ax,ay,az --plan sheet.csv -o run.csv");
  segment_app->add_option("log", segment.log, "text, .npy, .mat, also .gz .xz .zst; - is stdin")
      ->required()
      ->type_name("LOG");
  add_rest_options(*segment_app, segment.rests);
  add_text(*segment_app, "--range", segment.rests.range, "LO,HI",
           "samples at or beyond these are saturated");
  segment_app->add_flag("--recognise", segment.recognise,
                        "a cube's seats, by --accelerometer (the --columns) and --gyroscope or "
                        "--magnetometer");
  segment_app->add_flag("--keep-split", segment.keep_split,
                        "keep all parts of a rest that a knock split; else the longer one");
  add_output(*segment_app, segment.output);
  segment_app->add_flag("--json", segment.json, "print JSON instead of CSV");

  NoiseCommand noise;
  CLI::App* noise_app = app.add_subcommand("noise", "log at rest -> Allan deviation, noise");
  noise_app->footer("Example: axiscal noise rest.csv --columns gx,gy,gz --rate 100");
  noise_app->add_option("log", noise.log, "text, .npy, .mat, also .gz .xz .zst; - is stdin")
      ->required()
      ->type_name("LOG");
  add_text(*noise_app, "--columns", noise.columns, "A,B,..", "columns; all but the times");
  add_log_options(*noise_app, noise.options);
  noise_app->add_flag("--all-taus", noise.all_taus, "the curve at ten averaging times a decade");
  add_output(*noise_app, noise.output);
  noise_app->add_flag("--json", noise.json, "print JSON instead of a table");

  ApplyCommand apply;
  CLI::App* apply_app =
      app.add_subcommand("apply", "raw readings -> field components and angles; streams");
  apply_app->footer("Example: axiscal apply cal.json log.csv -o angles.csv");
  apply_app->add_option("record", apply.record, "calibration record (JSON)")
      ->required()
      ->type_name("RECORD");
  apply_app->add_option("readings", apply.readings, "raw readings (CSV); - is stdin")
      ->required()
      ->type_name("FILE");
  add_output(*apply_app, apply.output);
  apply_app
      ->add_option("--field-magnitude", apply.field_magnitude,
                   "of the field where the readings were taken; the record's")
      ->type_name("F");
  apply_app
      ->add_option("--field-unit", apply.field_unit,
                   "of --field-magnitude and of the results; the record's")
      ->type_name("UNIT");
  add_text(*apply_app, "--latitude", apply.latitude, "DEG",
           "where the readings were taken: its gravity");
  add_text(*apply_app, "--longitude", apply.longitude, "DEG", "of that site; 0");
  add_text(*apply_app, "--height", apply.height, "M", "of that site above the ellipsoid; 0");
  add_text(*apply_app, "--gravity-model", apply.gravity_model, "NAME", "of that site; wgs84");
  add_text(*apply_app, "--attitude", apply.attitude, "RECORD",
           "an accelerometer's, its axes in the same file: headings, second fields");
  add_text(*apply_app, "--declination", apply.declination, "DEG",
           "added to headings, makes them true; 0");
  apply_app
      ->add_option("--yaw-above", apply.yaw_above,
                   "pitch from which yaw is given instead of roll; 85")
      ->type_name("DEG");
  apply_app
      ->add_option("--pitch", apply.pitch, "pitch by asin(f_x / F), or by atan2 without F; asin")
      ->type_name("asin|atan2");
  apply_app->add_flag("--uncertainty", apply.uncertainty,
                      "state the standard uncertainty of each result, in columns u_...");
  add_text(*apply_app, "--noise", apply.noise, "SD",
           "of a reading, for --uncertainty; the scatter of the calibration");
  add_text(*apply_app, "--resolution", apply.resolution, "Q",
           "smallest step of a reading, for --uncertainty; the record's");
  add_text(*apply_app, "--temperature-u", apply.temperature_u, "U",
           "of the temperature output, for --uncertainty; the record's");
  add_text(*apply_app, "--temperature-column", apply.temperature_column, "NAME",
           "of a record with temperature terms; temperature");
  apply_app->add_flag("--follow", apply.follow, "write each row at once");
  apply_app->add_flag("--strict", apply.strict, "stop at a row that cannot be reduced");
  apply_app->add_flag("--force", apply.force, "use a refused record");

  PlanCommand plan;
  CLI::App* plan_app =
      app.add_subcommand("plan", "a run sheet in random order, and what it will reach");
  plan_app->footer(
      "Example: axiscal plan --noise 1e-4 --want-angle-deg 0.005 --seed 7 -o sheet.csv --page "
      "sheet.html\n"
      "Without -o the sheet goes to stdout and the forecast to stderr.");
  plan_app->add_option("experiment", plan.experiment, "instrument, field, cube and method (.json)")
      ->type_name("EXPERIMENT");
  add_sheet_options(*plan_app, plan.sheet);
  const auto add_plan = [plan_app](const char* group, const char* name,
                                   std::optional<std::string>& value, const char* type,
                                   const char* help) {
    add_text(*plan_app, name, value, type, help)->group(group);
  };
  add_plan("Forecast", "--noise", plan.noise, "SD", "sd of one sample, in the readings' unit");
  add_plan(
      "Forecast", "--noise-log", plan.noise_log, "FILE",
      "what `noise --json` wrote, instead of --noise: a reading is a mean over the dwell time");
  add_plan("Forecast", "--dwell", plan.dwell, "S",
           "time at a design point, with --noise-log; the sensible one of its noisiest axis");
  add_plan("Forecast", "--samples", plan.samples, "N", "averaged at each point; 1");
  add_plan("Forecast", "--want-angle-deg", plan.want_angle, "U",
           "standard uncertainty wanted of an angle: takes as many replicates as it needs");
  add_plan("Forecast", "--sensitivity", plan.sensitivity, "S", "of each axis, nominal; 1");
  add_plan("Forecast", "--method", plan.method, "METHOD", "paired, joint or known; by the design");
  add_plan("Forecast", "--positioner", plan.positioner, "FILE", "the cube; the nominal one");
  add_plan("Forecast", "--positioner-u", plan.positioner_u, "RAD",
           "standard uncertainty of each face normal, besides the positioner's covariance");
  add_plan("Forecast", "--slot", plan.slot, "NAME",
           "mount of the positioner that holds the instrument; its repeatability counts");
  add_plan("Forecast", "--level-u", plan.level_u, "RAD",
           "known: standard uncertainty of the table's slope along x and y");
  add_plan("Forecast", "--slope", plan.slope, "X,Y", "of the table, expected; 0,0");
  add_plan(
      "Tolerances", "--tolerances", plan.tolerances, "NAME=SD,..",
      "errors by how the cube is made: foot_height_m, ball_radius_m, squareness_rad, fence_rad");
  add_plan("Tolerances", "--trials", plan.trials, "N", "cubes simulated; 1000");
  add_plan("Temperature", "--soak", plan.soak, "LOG",
           "a log (CSV: time [s], temperature): is the instrument steady yet? Exit 1 when not");
  add_plan("Temperature", "--soak-window", plan.soak_window, "S",
           "how far to look back, and how long a block takes; 300");
  add_plan("Temperature", "--soak-tolerance", plan.soak_tolerance, "T",
           "largest change of the temperature output during that time; 0.1");
  plan_app->add_option("--page", plan.page, "the run sheet as a page to print")
      ->type_name("SHEET.html");
  plan_app->add_option("-o,--output", plan.output, "the run sheet (CSV); stdout")
      ->type_name("FILE");
  plan_app->add_flag("--json", plan.json, "print the forecast as JSON");

  SimulateCommand simulate;
  CLI::App* simulate_app = app.add_subcommand("simulate", "observations from a known truth");
  simulate_app->footer(
      "Example: axiscal simulate --truth cal.json --noise 1e-4 --slope -0.001,0.002 -o run.csv");
  simulate_app
      ->add_option("--truth", simulate.truths,
                   "calibration record; for an assembly SLOT=RECORD, once for each slot")
      ->required()
      ->take_all()
      ->expected(1)
      ->type_name("RECORD");
  add_sheet_options(*simulate_app, simulate.sheet);
  simulate_app->add_option("--noise", simulate.noise, "sd of a reading, in its unit; 0")
      ->type_name("SD");
  simulate_app->add_option("--slope", simulate.slope, "tilt of the table; 0,0")->type_name("X,Y");
  add_text(*simulate_app, "--temperature-sd", simulate.temperature_sd, "SD",
           "scatter of the temperatures about their levels; 0");
  add_text(*simulate_app, "--resolution", simulate.resolution, "Q",
           "readings are rounded to multiples of it");
  simulate_app
      ->add_option("--fence-azimuth", simulate.fence_azimuth,
                   "of the table's y axis; turns the field of the truth")
      ->type_name("DEG");
  simulate_app
      ->add_option("--positioner", simulate.positioner, "cube: feet or normals, fence, mounts")
      ->type_name("FILE");
  simulate_app
      ->add_option("--slot", simulate.slot, "mount of the positioner that holds the instrument")
      ->type_name("NAME");
  simulate_app->add_option("--assembly", simulate.assembly, "mounts of the slots, as by calibrate")
      ->type_name("NAME");
  add_output(*simulate_app, simulate.output);

  LevelCommand level;
  CLI::App* level_app =
      app.add_subcommand("level", "12 readings or a record -> what to turn to level the table");
  level_app->footer(
      "Example: axiscal level run.csv --instrument accelerometer --field gravity\n"
      "         --adjusters \"0.1,0;-0.1,0.08;-0.1,-0.08\" --thread-pitch 0.0005\n"
      "Raise the adjusters as it says, take 12 readings again, until it says that it is level.");
  add_files(*level_app, level.experiment);
  add_experiment_options(*level_app, level.experiment);
  level_app
      ->add_option("--adjusters", level.adjusters,
                   "where the table stands [m], frame table; the positioner's")
      ->type_name("X,Y;..");
  level_app
      ->add_option("--thread-pitch", level.thread_pitch, "what a turn raises; the positioner's")
      ->type_name("M");
  add_output(*level_app, level.output);
  level_app->add_flag("--json", level.json, "print JSON instead of a table");

  CharacterizeCommand characterize;
  CLI::App* characterize_app =
      app.add_subcommand("characterize", "calibrated instruments -> a measured positioner");
  characterize_app->footer(
      "Example: axiscal characterize --reference a.json=a.csv --reference b.json=b.csv\n"
      "         --id cube-07 -o cube-07.json\n"
      "The 12 points, several times (replicates). A record that is there twice is one instrument,\n"
      "fitted anew: that shows the repeatability of the mount.");
  characterize_app
      ->add_option("--reference", characterize.references,
                   "an instrument's record and its readings in the cube; once for each")
      ->required()
      ->take_all()
      ->expected(1)
      ->type_name("RECORD=OBS");
  characterize_app->add_option("--id", characterize.id, "name of the cube")
      ->required()
      ->type_name("NAME");
  characterize_app
      ->add_option("-o,--output", characterize.output, "the positioner (JSON); - is stdout")
      ->required()
      ->type_name("FILE");
  characterize_app
      ->add_option("--drawing", characterize.drawing,
                   "the cube as drawn: its feet make seats exact")
      ->type_name("FILE");
  characterize_app
      ->add_option("--level-by", characterize.level_by,
                   "one levelness for each reference (run, default) or for each block")
      ->type_name("run|block");
  characterize_app->add_option("--leave-out", characterize.leave_out, "slots not to use, e.g. A,B")
      ->type_name("SLOTS");
  characterize_app->add_flag("--hold-bias-and-scale", characterize.hold_bias_and_scale,
                             "take bias and scale from the records; else they are fitted anew");
  characterize_app->add_flag("--json", characterize.json, "print JSON instead of tables");

  CheckCommand check;
  CLI::App* check_app = app.add_subcommand(
      "check", "fresh observations, or another record, against a calibration: has it drifted?");
  check_app->footer(
      "Example: axiscal check cal.json today.csv\n"
      "Readings without labels are checked at rest, by the size of the field alone. Options count\n"
      "where they differ from the record's. Exit 1 when it has drifted or a limit is not met.\n"
      "         axiscal check --history records/ --limits limits.json");
  check_app->add_option("record", check.record, "calibration record (JSON)")->type_name("RECORD");
  check_app->add_option("other", check.other, "observations (CSV) or another record (JSON)")
      ->type_name("FILE");
  add_experiment_options(*check_app, check.experiment);
  add_text(*check_app, "--alpha", check.alpha, "P", "probability of a false alarm; 0.01");
  add_text(*check_app, "--limits", check.limits, "FILE", "accept or reject by these limits");
  add_text(*check_app, "--history", check.history, "FOLDER",
           "records of one or many units: trend, and when a limit will be met");
  add_output(*check_app, check.output);
  check_app->add_flag("--json", check.json, "print JSON instead of a table");

  BudgetCommand budget;
  CLI::App* budget_app = app.add_subcommand(
      "budget", "a record's uncertainty by source: coefficients, and readings in any attitude");
  budget_app->footer(
      "Example: axiscal budget cal.json --pitch 30 --roll 45 --monte-carlo 20000\n"
      "         axiscal budget cal.json --map 15");
  budget_app->add_option("record", budget.record, "calibration record (JSON)")
      ->required()
      ->type_name("RECORD");
  add_text(*budget_app, "--pitch", budget.pitch, "DEG", "of the attitude that is read");
  add_text(*budget_app, "--roll", budget.roll, "DEG", "of it; 0");
  add_text(*budget_app, "--temperature", budget.temperature, "T",
           "of the sensor there; the record's reference");
  add_text(*budget_app, "--noise", budget.noise, "SD",
           "of a reading there; the scatter of the calibration");
  add_text(*budget_app, "--pitch-formula", budget.pitch_formula, "asin|atan2",
           "as apply --pitch; asin");
  add_text(*budget_app, "--map", budget.map, "DEG",
           "expanded uncertainty of pitch and roll over all attitudes, in steps");
  add_text(*budget_app, "--monte-carlo", budget.monte_carlo, "N",
           "check the linear propagation in the attitude by N trials (JCGM 101)");
  add_text(*budget_app, "--seed", budget.seed, "S", "of the trials; 1");
  add_output(*budget_app, budget.output);
  budget_app->add_flag("--json", budget.json, "print JSON instead of tables");

  StudyCommand study;
  CLI::App* study_app = app.add_subcommand(
      "study", "Monte Carlo of the whole chain: bias, scatter, stated uncertainty, coverage");
  study_app->footer(
      "Example: axiscal study --truth cal.json --noise 1e-4 --trials 2000 --seed 7\n"
      "         parallel axiscal study --truth cal.json --noise 1e-4 --trials 100000 --seed 7 \\\n"
      "           --shard {}/8 -o part{}.json ::: 1 2 3 4 5 6 7 8; axiscal study --merge "
      "part*.json");
  study_app->add_option("experiment", study.experiment.files, "experiment (.json)")
      ->type_name("EXPERIMENT");
  add_text(*study_app, "--truth", study.truth, "RECORD", "the true instrument and field");
  add_experiment_options(*study_app, study.experiment);
  add_sheet_options(*study_app, study.sheet);
  add_text(*study_app, "--trials", study.trials, "N", "runs simulated and calibrated; 1000");
  add_text(*study_app, "--shard", study.shard, "I/N", "part I of N of the trials; for --merge");
  add_text(*study_app, "--noise", study.noise, "SD[,SD..]",
           "of a reading, for all axes or each; the truth's residual_sd");
  add_text(*study_app, "--slope-sd", study.slope_sd, "RAD",
           "each run's table is tilted by this much more; 0");
  add_text(*study_app, "--temperature-sd", study.temperature_sd, "SD",
           "scatter of the temperatures about their levels; 0");
  add_text(*study_app, "--tolerances", study.tolerances, "NAME=SD,..",
           "each run has a cube made with such errors, which the calibration does not know");
  study_app->add_flag("--random-normals", study.random_normals,
                      "each run's cube differs from --positioner by its normal_covariance");
  study_app->add_flag("--regression-only", study.regression_only,
                      "noise alone on a field known exactly: millions of trials a second");
  study_app->add_option("--merge", study.merge, "put shards together")->type_name("FILES");
  add_output(*study_app, study.output);
  study_app->add_flag("--json", study.json, "print JSON instead of a table");

  ExportCommand export_;
  CLI::App* export_app =
      app.add_subcommand("export", "calibration record -> formats of other software");
  export_app->footer(
      "Example: axiscal export cal.json --format c-header --name imu_accel -o imu_accel.h");
  export_app->add_option("record", export_.record, "calibration record (JSON)")
      ->type_name("RECORD");
  add_text(*export_app, "--format", export_.format, "NAME", "one of --list");
  export_app->add_flag("--list", export_.list, "the formats, and what their readers compute");
  add_text(*export_app, "--reading-factor", export_.reading_factor, "R",
           "what the consumer's driver makes of 1 unit of the readings (m/s^2 per count)");
  add_text(*export_app, "--gravity", export_.gravity, "G",
           "m/s^2 that 1 g was, of a record in g that does not say it");
  add_text(*export_app, "--numbers", export_.numbers, "TYPE",
           "of a header: double, float, q16, q0:16 (binary places of readings, of the field)");
  add_text(*export_app, "--name", export_.name, "ID", "what a header's names start with; axiscal");
  add_text(*export_app, "--instance", export_.instance, "N", "number of the sensor, 0 to 9; 0");
  add_text(*export_app, "--laboratory", export_.laboratory, "FILE",
           "of dcc: laboratory, customer, number, ... as report --laboratory");
  export_app->add_flag("--lossy", export_.lossy,
                       "write what the format holds, and say what is lost");
  export_app->add_flag("--force", export_.force, "take a refused record too");
  add_output(*export_app, export_.output);

  ImportCommand import;
  CLI::App* import_app =
      app.add_subcommand("import", "calibration of other software -> calibration record");
  import_app->footer(
      "Example: axiscal import drone.params --format px4 -o old.json\n"
      "         axiscal check old.json run.csv");
  import_app->add_option("file", import.file, "their file; - is stdin")
      ->required()
      ->type_name("FILE");
  add_text(*import_app, "--format", import.format, "NAME", "px4, ardupilot, kalibr or imucal");
  add_text(*import_app, "--instrument", import.instrument, "KIND",
           "accelerometer (default), gyroscope or magnetometer: which of its sensors");
  add_text(*import_app, "--instance", import.instance, "N", "number of the sensor, 0 to 9; 0");
  add_text(*import_app, "--magnitude", import.magnitude, "F",
           "of the field, in the format's unit; 9.80665 m/s^2, 1 rad/s, 0.5 G");
  add_output(*import_app, import.output);

  AcquireCommand acquire;
  acquire.arguments = arguments;
  CLI::App* acquire_app =
      app.add_subcommand("acquire", "a live instrument -> observations, guided");
  acquire_app->footer(
      "Examples: axiscal acquire --connect 'serial:/dev/ttyUSB0?names=x,y,z' --instrument "
      "accelerometer --field gravity --unit V\n"
      "          axiscal acquire --connect 'sim:?error=0.1'   (no hardware: try it)\n"
      "          axiscal acquire --check cal.json --connect tcp://host:4000");
  const auto add_acquire = [acquire_app](const char* group, const char* name,
                                         std::optional<std::string>& value, const char* type,
                                         const char* help) {
    add_text(*acquire_app, name, value, type, help)->group(group);
  };
  acquire_app
      ->add_option("experiment", acquire.experiment.files,
                   "instrument, field, cube and method (.json)")
      ->type_name("FILE");
  acquire_app
      ->add_option("--connect", acquire.sources,
                   "where samples come from; several: the first sets the pace; --list shows kinds")
      ->type_name("ADDRESS")
      ->group("Source");
  acquire_app->add_flag("--list", acquire.list, "what is connected, and the kinds of sources")
      ->group("Source");
  add_acquire("Source", "--temperature-column", acquire.temperature_column, "NAME",
              "channel of the temperature; temperature");
  add_experiment_options(*acquire_app, acquire.experiment);
  add_sheet_options(*acquire_app, acquire.sheet);
  add_acquire("Session", "--plan", acquire.plan, "SHEET", "run sheet, instead of a design");
  add_acquire("Session", "--noise", acquire.noise, "SD|FILE",
              "of one sample at rest, or what `noise --json` wrote: what counts as still, and how "
              "long to dwell; learned");
  add_acquire("Session", "--window", acquire.window, "S", "of the sliding variance; 0.5");
  add_acquire("Session", "--dwell", acquire.dwell, "S",
              "how long a reading is taken; by the noise, 1 to 20");
  add_acquire("Session", "--placement-u", acquire.placement_u, "RAD",
              "how well a seat is taken again (1 sd); 3e-5");
  add_acquire("Session", "--soak-window", acquire.soak_window, "S",
              "the temperature is steady over it before a block; 300");
  add_acquire("Session", "--soak-tolerance", acquire.soak_tolerance, "T",
              "largest change of the temperature output meanwhile; 0.1");
  acquire_app->add_flag("--manual", acquire.manual, "take readings on command, not by themselves")
      ->group("Session");
  acquire_app
      ->add_flag("--unattended", acquire.unattended,
                 "nobody answers: what looks wrong at the end is asked for again, then it ends")
      ->group("Session");
  add_acquire("Files", "--name", acquire.name, "NAME",
              "of the files: NAME.journal, .csv, .json, .html; axiscal-TIME");
  add_acquire("Files", "--journal", acquire.journal, "FILE", "a new file that only grows");
  add_acquire("Files", "--resume", acquire.resume, "JOURNAL", "go on where a session stopped");
  acquire_app->add_flag("--raw", acquire.raw, "keep every sample in the journal")->group("Files");
  acquire_app->add_option("-o,--output", acquire.output, "the readings (CSV)")
      ->type_name("FILE")
      ->group("Files");
  add_acquire("Files", "--record", acquire.record, "FILE", "the calibration record");
  add_acquire("Files", "--report", acquire.report, "FILE", "the report (HTML)");
  add_acquire("Health", "--check", acquire.check, "RECORD",
              "an installed instrument, in whatever pose it is: has it drifted? Exit status 1");
  add_acquire("Health", "--readings", acquire.readings, "N", "at rest, until the verdict; 3");
  add_acquire("Health", "--within", acquire.within, "S", "give up after this time; 60");
  acquire_app->add_flag("--plain", acquire.plain, "lines of words, commands as words on stdin")
      ->group("Face");
  acquire_app->add_flag("--json", acquire.json, "events as JSON lines, commands on stdin")
      ->group("Face");
  acquire_app->add_flag("--web", acquire.web, "a page for the browser, on loopback")->group("Face");
  add_acquire("Face", "--port", acquire.port, "N", "of the page; 8712, or the next free one");
  add_acquire("Face", "--listen", acquire.listen, "ADDRESS",
              "serve the page at this address, encrypted, by one-time keys (QR code)");

  ReportCommand report;
  CLI::App* report_app = app.add_subcommand("report", "calibration record -> a report to look at");
  report_app->footer("Example: axiscal report cal.json run.csv -o report.html");
  report_app->add_option("record", report.record, "calibration record (JSON)")
      ->required()
      ->type_name("RECORD");
  add_text(*report_app, "observations", report.observations, "OBS",
           "its readings (CSV), for their values, times and directions");
  add_text(*report_app, "--history", report.history, "FOLDER",
           "records of the same unit: its drift over the years");
  add_text(*report_app, "--adjusters", report.adjusters, "X,Y;X,Y;..",
           "where the table's height adjusters stand [m]: the turns that level it");
  add_text(*report_app, "--thread-pitch", report.thread_pitch, "M", "of the adjusters");
  add_text(*report_app, "--positioner", report.positioner, "FILE",
           "with a table and its adjusters");
  add_text(*report_app, "--noise", report.noise, "FILE",
           "of the instrument at rest (noise --json): its Allan deviation");
  add_text(*report_app, "--laboratory", report.laboratory, "FILE",
           "of a certificate: laboratory, customer, number, ... (axiscal-laboratory, JSON)");
  report_app->add_option("-o,--output", report.output, "a report (.html), or a certificate (.pdf)")
      ->required()
      ->type_name("FILE");

  TemplateCommand template_;
  CLI::App* template_app =
      app.add_subcommand("template", "an example of each file that is written by hand");
  template_app->footer("Example: axiscal template limits -o limits.json");
  template_app
      ->add_option("name", template_.name, "experiment, laboratory, limits, map or positioner")
      ->required()
      ->type_name("NAME");
  add_output(*template_app, template_.output);

  if (arguments.empty()) {
    throw UsageError("a subcommand is missing\n\n" + app.help());
  }
  CLI::App* chosen = nullptr;
  const std::string first = arguments.front();
  if (first == "--generate") {
    const std::string text =
        arguments.size() == 2 ? generated(definition_of(app), arguments[1]) : std::string();
    if (text.empty()) {
      throw UsageError("--generate: man, bash, zsh or fish");
    }
    return ShowText{text};
  }
  if (!first.starts_with("-")) {
    std::vector<std::string> names;
    for (CLI::App* subcommand : app.get_subcommands(nullptr)) {
      names.push_back(subcommand->get_name());
      chosen = subcommand->get_name() == first ? subcommand : chosen;
    }
    if (chosen == nullptr) {
      const std::vector<std::string_view> views(names.begin(), names.end());
      throw UsageError("unknown subcommand '" + first + "'" + did_you_mean(first, views));
    }
  }
  try {
    if (chosen != nullptr) {
      arguments = with_joined_values(*chosen, arguments);
    }
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
    app.parse(arguments);
  } catch (const CLI::CallForHelp&) {
    return ShowText{chosen != nullptr ? chosen->help("axiscal") : app.help()};
  } catch (const CLI::CallForVersion&) {
    return ShowText{std::string(software_name()) + "\n"};
  } catch (const CLI::ParseError& error) {
    throw UsageError(error.what());
  }
  if (*field_app) {
    return field;
  }
  if (*calibrate_app) {
    if (calibrate.experiment.files.empty() == !calibrate.imu.has_value()) {
      throw UsageError("calibrate: needs FILEs of observations, or --imu LOG, one of them");
    }
    return calibrate;
  }
  if (*segment_app) {
    return segment;
  }
  if (*noise_app) {
    return noise;
  }
  if (*apply_app) {
    return apply;
  }
  if (*plan_app) {
    return plan;
  }
  if (*check_app) {
    return check;
  }
  if (*budget_app) {
    return budget;
  }
  if (*study_app) {
    return study;
  }
  if (*export_app) {
    return export_;
  }
  if (*import_app) {
    return import;
  }
  if (*report_app) {
    return report;
  }
  if (*acquire_app) {
    return acquire;
  }
  if (*template_app) {
    return template_;
  }
  if (*level_app) {
    return level;
  }
  if (*characterize_app) {
    return characterize;
  }
  return simulate;
}

}  // namespace axiscal::cli

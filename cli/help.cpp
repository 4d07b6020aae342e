// SPDX-License-Identifier: Apache-2.0
#include "help.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "axiscal/core/wrapped_text.hpp"
#include "core/formatted.hpp"

namespace axiscal::cli {
namespace {

// The most useful options of a subcommand, and examples of its use.
struct Essentials {
  std::string_view subcommand;
  std::string_view options;  // long names, separated by commas, without dashes
  std::array<std::string_view, 3> examples;
};

constexpr std::array essentials = {
    Essentials{"field",
               "latitude,longitude,height,date,only,json,output",
               {"axiscal field --latitude 48.14 --longitude 11.58 --height 520",
                "axiscal field --latitude 48.14 --longitude 11.58 --date 2026-06-21 --json",
                "axiscal field --latitude 48.14 --longitude 11.58 --only geomagnetic"}},
    Essentials{
        "log",
        "json,output,limit",
        {"axiscal log flight.ulg", "axiscal log phyphox.zip", "axiscal log bag.mcap --json"}},
    Essentials{"calibrate",
               "instrument,unit,field,method,axes,serial,imu,limits,output",
               {"axiscal calibrate run.csv --instrument accelerometer --unit V -o cal.json",
                "axiscal calibrate --imu log.csv -o 'imu-{slot}.json'",
                "axiscal calibrate mag.csv --axes mx,my,mz --instrument magnetometer --unit uT "
                "--field geomagnetic --field-magnitude 48 --field-unit uT --method magnitude -o "
                "mag.json"}},
    Essentials{"segment",
               "columns,plan,regions,rate,accelerometer,recognise,output",
               {"axiscal segment log.csv --columns ax,ay,az --plan sheet.csv -o run.csv",
                "axiscal segment phone.csv --columns x,y,z -o rests.csv",
                "axiscal segment flight.ulg --instance 1 -o rests.csv"}},
    Essentials{"noise",
               "columns,rate,tau,format,output,json,instance",
               {"axiscal noise rest.csv --columns gx,gy,gz --rate 100",
                "axiscal noise rest.csv -o noise.html",
                "axiscal noise rest.ulg --format kalibr -o imu.yaml"}},
    Essentials{"apply",
               "output,uncertainty,expanded,attitude,body,follow,strict",
               {"axiscal apply cal.json log.csv -o angles.csv",
                "axiscal apply cal.json log.csv --uncertainty",
                "tail -n +1 -f log.csv | axiscal apply cal.json - --follow"}},
    Essentials{"plan",
               "design,replicates,seed,noise,want-angle-deg,output,page,json",
               {"axiscal plan -o sheet.csv --page sheet.html",
                "axiscal plan --noise 1e-4 --want-angle-deg 0.005 -o sheet.csv",
                "axiscal plan --design optimal:8 --noise 1e-4 --json"}},
    Essentials{"simulate",
               "truth,noise,slope,replicates,design,seed,recording,output",
               {"axiscal simulate --truth cal.json --noise 1e-4 -o run.csv",
                "axiscal simulate --truth cal.json --slope=-0.001,0.002 --replicates 4 -o run.csv",
                "axiscal simulate --truth mag.json --recording free --samples 2000 -o turned.csv"}},
    Essentials{"level",
               "adjusters,thread-pitch,positioner,instrument,output,json",
               {"axiscal level cal.json --adjusters '0.1,0;-0.1,0.08;-0.1,-0.08'",
                "axiscal level run.csv --instrument accelerometer --adjusters "
                "'0.1,0;-0.1,0.08;-0.1,-0.08' --thread-pitch 0.0005",
                "axiscal level cal.json --positioner table.json --json"}},
    Essentials{
        "characterize",
        "reference,id,output,drawing,json",
        {"axiscal characterize --reference a.json=a.csv --id cube-07 -o cube-07.json",
         "axiscal characterize --reference a.json=a.csv --reference b.json=b.csv --id "
         "cube-07 -o cube-07.json",
         "axiscal characterize --reference a.json=a.csv --id cube-07 -o cube-07.json --json"}},
    Essentials{"check",
               "limits,history,alpha,field,output,json",
               {"axiscal check cal.json today.csv", "axiscal check old.json new.json",
                "axiscal check --history records/ --limits limits.json"}},
    Essentials{"budget",
               "pitch,roll,attitudes,monte-carlo,output,json",
               {"axiscal budget cal.json", "axiscal budget cal.json --pitch 30 --roll 45",
                "axiscal budget cal.json --attitudes 15"}},
    Essentials{"merge",
               "output",
               {"axiscal merge part1.jsonl part2.jsonl -o records.jsonl",
                "axiscal merge part1.csv part2.csv -o units.csv",
                "axiscal merge part*.jsonl.zst -o records.jsonl.zst"}},
    Essentials{"study",
               "truth,noise,trials,design,method,world,alarms,json",
               {"axiscal study --truth cal.json --noise 1e-4 --trials 2000",
                "axiscal study --truth cal.json --noise 1e-4 --world block_sd=1e-4",
                "axiscal study --merge part1.json part2.json"}},
    Essentials{"export",
               "format,list,reading-factor,lossy,unit,output",
               {"axiscal export cal.json --format c-header -o imu_accel.h",
                "axiscal export imu-accelerometer.json --format px4 --lossy -o drone.params",
                "axiscal export cal.json --format xlsx -o cal.xlsx"}},
    Essentials{"import",
               "format,instrument,instance,magnitude,output",
               {"axiscal import drone.params --format px4 -o old.json",
                "axiscal import imu.yaml --format kalibr -o old.json",
                "axiscal import apm.param --format ardupilot --instance 1 -o old.json"}},
    Essentials{"acquire",
               "connect,list,instrument,unit,free,web,name,resume,check",
               {"axiscal acquire --connect 'sim:?error=0.1' --web",
                "axiscal acquire --connect 'serial:/dev/ttyUSB0?names=x,y,z' --instrument "
                "accelerometer --unit V",
                "axiscal acquire --free --connect 'serial:/dev/ttyACM0?names=x,y,z' --instrument "
                "magnetometer --unit uT --web"}},
    Essentials{"report",
               "history,noise,laboratory,adjusters,output",
               {"axiscal report cal.json run.csv -o report.html",
                "axiscal report cal.json --laboratory lab.json -o certificate.pdf",
                "axiscal report --fleet lab.db -o fleet.html"}},
    Essentials{"store",
               "store,serial,at,yield,output,json",
               {"axiscal store add records/ --store lab.db",
                "axiscal store show --store lab.db --serial QA-113 --at 2026-11-01",
                "axiscal store list --store lab.db --yield"}},
    Essentials{"template",
               "output",
               {"axiscal template", "axiscal template laboratory -o lab.json",
                "axiscal template experiment -o experiment.json"}},
};

const Essentials* find(const std::string& subcommand) {
  const auto at = std::find_if(essentials.begin(), essentials.end(),
                               [&](const Essentials& one) { return one.subcommand == subcommand; });
  return at == essentials.end() ? nullptr : &*at;
}

constexpr std::size_t help_width = 80;
constexpr std::size_t help_column = 24;

// Returns "  name     description" in wrapped lines. The description begins on a new line if the
// name is too long.
std::string entry(const std::string& name, const std::string& description) {
  std::string text = "  " + name;
  text += text.size() + 2 <= help_column ? std::string(help_column - text.size(), ' ')
                                         : "\n" + std::string(help_column, ' ');
  for (const char c : wrapped(description, help_width - help_column, 0)) {
    text += c;
    text += c == '\n' ? std::string(help_column, ' ') : "";
  }
  return text + "\n";
}

// Returns a command line in wrapped lines. Each line except the last one ends with a backslash.
std::string command_lines(const std::string& command) {
  std::string text = "  " + wrapped(command, help_width - 4, 6);
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at + 3)) {
    text.insert(at, " \\");
  }
  return text + "\n";
}

std::string entry(const OptionDefinition& option, const std::string& description) {
  std::string names = joined(option.names);
  if (!option.is_argument && !option.type.empty()) {
    names += " " + option.type;
  }
  return entry(names, description + (option.is_required ? " (required)" : ""));
}

// Returns the description up to its first semicolon, followed by the default value.
std::string first_clause(const std::string& description) {
  const std::size_t stated = description.find(" [default:");
  const std::size_t end = description.find(';');
  if (end == std::string::npos || end > stated) {
    return description;
  }
  return description.substr(0, end) +
         (stated == std::string::npos ? "" : description.substr(stated));
}

// Returns the usage line ("Usage: axiscal apply [options] record readings") and the examples.
std::string opening(const SubcommandDefinition& subcommand) {
  std::string usage = formatted("Usage: axiscal {} [options]", subcommand.name);
  for (const OptionDefinition& option : subcommand.options) {
    if (option.is_argument) {
      const std::string& name = option.names.front();
      usage += option.is_required ? " " + name : formatted(" [{}]", name);
    }
  }
  std::string text;
  for (const std::string& example : subcommand.examples) {
    text += command_lines(example);
  }
  return text + usage + "\n";
}

}  // namespace

std::vector<std::string> examples_of(const std::string& subcommand) {
  const Essentials* const found = find(subcommand);
  return found == nullptr
             ? std::vector<std::string>()
             : std::vector<std::string>(found->examples.begin(), found->examples.end());
}

std::string overview(const ProgramDefinition& program) {
  std::string text = formatted("{}\n", program.help);
  text += command_lines(examples_of("calibrate").front());
  text += command_lines(examples_of("apply").front());
  for (const SubcommandDefinition& subcommand : program.subcommands) {
    text += formatted("  {:<14}{}\n", subcommand.name, subcommand.help);
  }
  return text + "`axiscal help SUBCOMMAND` prints the options, `axiscal --version` the version.\n";
}

std::string short_help(const SubcommandDefinition& subcommand) {
  const Essentials* const found = find(subcommand.name);
  const std::vector<std::string_view> shown =
      split(found == nullptr ? std::string_view() : found->options, ',');
  std::string text = opening(subcommand);
  std::size_t hidden = 0;
  for (const OptionDefinition& option : subcommand.options) {
    const std::string_view name = option.names.back();
    const bool is_shown =
        option.is_argument ||
        std::find(shown.begin(), shown.end(), name.substr(std::min<std::size_t>(2, name.size()))) !=
            shown.end();
    text += is_shown ? entry(option, first_clause(option.help)) : "";
    hidden += is_shown ? 0U : 1U;
  }
  return text + formatted("{} more options, and details: axiscal {} --help-all\n", hidden,
                          subcommand.name);
}

std::string full_help(const SubcommandDefinition& subcommand) {
  std::string text = subcommand.help + "\n\n" + opening(subcommand);
  std::string group;
  for (const OptionDefinition& option : subcommand.options) {
    if (option.group != group) {
      group = option.group;
      text += formatted("\n{}:\n", group);
    }
    text += entry(option, option.help);
  }
  return text + (subcommand.remarks.empty() ? "" : "\n" + subcommand.remarks + "\n");
}

}  // namespace axiscal::cli

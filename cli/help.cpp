// SPDX-License-Identifier: Apache-2.0
#include "help.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal::cli {
namespace {

// The options that most calls of a subcommand need.
struct Essentials {
  std::string_view subcommand;
  std::string_view options;  // without dashes; empty: all options
  std::array<std::string_view, 3> examples;
};

constexpr std::array essentials = {
    Essentials{"field",
               "",
               {"axiscal field --latitude 48.14 --longitude 11.58 --height 520",
                "axiscal field --latitude 48.14 --longitude 11.58 --date 2026-06-21 --json",
                "axiscal field --latitude 48.14 --longitude 11.58 --only geomagnetic"}},
    Essentials{
        "log",
        "",
        {"axiscal log flight.ulg", "axiscal log phyphox.zip", "axiscal log bag.mcap --json"}},
    Essentials{"calibrate",
               "instrument,unit,field,method,axes,serial,positioner,imu,limits,output",
               {"axiscal calibrate run.csv --instrument accelerometer --unit V -o cal.json",
                "axiscal calibrate --imu log.csv -o 'imu-{slot}.json'",
                "axiscal calibrate mag.csv --axes mx,my,mz --instrument magnetometer --unit uT "
                "--field geomagnetic --field-magnitude 48 --field-unit uT --method magnitude -o "
                "mag.json"}},
    Essentials{
        "segment",
        "columns,plan,regions,rate,window,min-length,threshold,accelerometer,recognise,output",
        {"axiscal segment log.csv --columns ax,ay,az --plan sheet.csv -o run.csv",
         "axiscal segment phone.csv --columns x,y,z -o rests.csv",
         "axiscal segment flight.ulg --instance 1 -o rests.csv"}},
    Essentials{"noise",
               "columns,rate,tau,all,format,output,json,time,instance,curve",
               {"axiscal noise rest.csv --columns gx,gy,gz --rate 100",
                "axiscal noise rest.csv -o noise.html",
                "axiscal noise rest.ulg --format kalibr -o imu.yaml"}},
    Essentials{"apply",
               "output,uncertainty,expanded,field-magnitude,attitude,body,declination,follow,"
               "strict,names",
               {"axiscal apply cal.json log.csv -o angles.csv",
                "axiscal apply cal.json log.csv --uncertainty",
                "tail -n +1 -f log.csv | axiscal apply cal.json - --follow"}},
    Essentials{"plan",
               "design,replicates,seed,noise,want-angle-deg,positioner,output,page,temperatures,"
               "json",
               {"axiscal plan -o sheet.csv --page sheet.html",
                "axiscal plan --noise 1e-4 --want-angle-deg 0.005 -o sheet.csv",
                "axiscal plan --design optimal:8 --noise 1e-4 --json"}},
    Essentials{"simulate",
               "truth,noise,slope,replicates,design,seed,recording,world,positioner,output",
               {"axiscal simulate --truth cal.json --noise 1e-4 -o run.csv",
                "axiscal simulate --truth cal.json --slope=-0.001,0.002 --replicates 4 -o run.csv",
                "axiscal simulate --truth mag.json --recording free --samples 2000 -o turned.csv"}},
    Essentials{"level",
               "adjusters,thread-pitch,positioner,instrument,unit,field,slope,serial,output,json",
               {"axiscal level cal.json --adjusters '0.1,0;-0.1,0.08;-0.1,-0.08'",
                "axiscal level run.csv --instrument accelerometer --adjusters "
                "'0.1,0;-0.1,0.08;-0.1,-0.08' --thread-pitch 0.0005",
                "axiscal level cal.json --positioner table.json --json"}},
    Essentials{
        "characterize",
        "",
        {"axiscal characterize --reference a.json=a.csv --id cube-07 -o cube-07.json",
         "axiscal characterize --reference a.json=a.csv --reference b.json=b.csv --id "
         "cube-07 -o cube-07.json",
         "axiscal characterize --reference a.json=a.csv --id cube-07 -o cube-07.json --json"}},
    Essentials{"check",
               "limits,history,alpha,output,json,field,positioner,names,map,serial",
               {"axiscal check cal.json today.csv", "axiscal check old.json new.json",
                "axiscal check --history records/ --limits limits.json"}},
    Essentials{"budget",
               "",
               {"axiscal budget cal.json", "axiscal budget cal.json --pitch 30 --roll 45",
                "axiscal budget cal.json --attitudes 15"}},
    Essentials{"study",
               "truth,noise,trials,seed,design,replicates,method,world,alarms,json",
               {"axiscal study --truth cal.json --noise 1e-4 --trials 2000",
                "axiscal study --truth cal.json --noise 1e-4 --world block_sd=1e-4",
                "axiscal study --merge part1.json part2.json"}},
    Essentials{"export",
               "",
               {"axiscal export cal.json --format c-header -o imu_accel.h",
                "axiscal export imu-accelerometer.json --format px4 --lossy -o drone.params",
                "axiscal export cal.json --format xlsx -o cal.xlsx"}},
    Essentials{"import",
               "",
               {"axiscal import drone.params --format px4 -o old.json",
                "axiscal import imu.yaml --format kalibr -o old.json",
                "axiscal import apm.param --format ardupilot --instance 1 -o old.json"}},
    Essentials{"acquire",
               "connect,list,instrument,unit,free,web,plan,name,resume,check",
               {"axiscal acquire --connect 'sim:?error=0.1' --web",
                "axiscal acquire --connect 'serial:/dev/ttyUSB0?names=x,y,z' --instrument "
                "accelerometer --unit V",
                "axiscal acquire --free --connect 'serial:/dev/ttyACM0?names=x,y,z' --instrument "
                "magnetometer --unit uT --web"}},
    Essentials{"report",
               "",
               {"axiscal report cal.json run.csv -o report.html",
                "axiscal report cal.json --laboratory lab.json -o certificate.pdf",
                "axiscal report cal.json --history records/ -o report.html"}},
    Essentials{"template",
               "",
               {"axiscal template", "axiscal template laboratory -o lab.json",
                "axiscal template experiment -o experiment.json"}},
};

const Essentials* find(const std::string& subcommand) {
  const auto at = std::find_if(essentials.begin(), essentials.end(),
                               [&](const Essentials& one) { return one.subcommand == subcommand; });
  return at == essentials.end() ? nullptr : &*at;
}

}  // namespace

std::string examples_of(const std::string& subcommand) {
  const Essentials* const found = find(subcommand);
  std::string text;
  if (found != nullptr) {
    for (const std::string_view example : found->examples) {
      text += formatted("  {}\n", example);
    }
  }
  return text;
}

std::string help_of(CLI::App& subcommand, bool all) {
  const std::string name = subcommand.get_name();
  const Essentials* const found = find(name);
  std::size_t hidden = 0;
  if (!all && found != nullptr && !found->options.empty()) {
    const std::vector<std::string_view> shown = split(found->options, ',');
    for (CLI::Option* const option : subcommand.get_options()) {
      const std::vector<std::string>& names = option->get_lnames();
      const bool is_shown = names.empty() || names.front() == "help" ||
                            std::find(shown.begin(), shown.end(), names.front()) != shown.end();
      if (!is_shown) {
        option->group("");
        ++hidden;
      } else if (!names.empty()) {
        option->group("Options");
      }
    }
  }
  std::string footer = subcommand.get_footer();
  footer += footer.empty() ? "" : "\n\n";
  footer += formatted("Examples:\n{}", examples_of(name));
  if (hidden > 0) {
    footer += formatted("\n{} more options: axiscal {} --help-all", hidden, name);
  }
  subcommand.footer(footer);
  return subcommand.help("axiscal");
}

}  // namespace axiscal::cli

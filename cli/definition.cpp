// SPDX-License-Identifier: Apache-2.0
#include "definition.hpp"

#include <algorithm>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal::cli {
namespace {

// Escapes a text for roff.
std::string roff(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '\\') {
      safe += "\\e";
    } else if (c == '-') {
      safe += "\\-";
    } else if ((c == '.' || c == '\'') && (safe.empty() || safe.back() == '\n')) {
      safe += std::string("\\&") + c;
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string roff_heading(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  });
  return formatted(".SH {}\n", text);
}

// Returns "-o, --output FILE" in roff, with the names of the option in bold.
std::string roff_names(const OptionDefinition& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.names) {
    names.push_back(formatted("{}{}\\fR", option.is_argument ? "\\fI" : "\\fB", roff(name)));
  }
  return joined(names) +
         (option.type.empty() || option.is_argument ? "" : " \\fI" + roff(option.type) + "\\fR");
}

std::string man_page(const ProgramDefinition& program) {
  std::string text = formatted(".TH {} 1 \"\" \"{}\"\n", roff(program.name), roff(program.version));
  text += formatted("{}{} \\- {}\n", roff_heading("name"), roff(program.name), roff(program.help));
  text += formatted("{}.B {}\n\\fISUBCOMMAND\\fR [\\fIOPTIONS\\fR] [\\fIFILES\\fR]\n",
                    roff_heading("synopsis"), roff(program.name));
  text += roff_heading("description") +
          "A file named \\- is standard input or output. An option's value may start with a minus "
          "sign; \\fB\\-\\-option=value\\fR works too.\n";
  text += roff_heading("subcommands");
  for (const SubcommandDefinition& subcommand : program.subcommands) {
    text += formatted(".SS {}\n{}.\n", roff(subcommand.name), roff(subcommand.help));
    for (const OptionDefinition& option : subcommand.options) {
      text += formatted(".TP\n{}\n{}\n", roff_names(option), roff(option.help));
    }
    if (!subcommand.remarks.empty()) {
      text += formatted(".PP\n.nf\n{}\n.fi\n", roff(subcommand.remarks));
    }
    text +=
        formatted(".PP\nExamples:\n.PP\n.nf\n{}\n.fi\n", roff(joined(subcommand.examples, "\n")));
  }
  text += roff_heading("exit status") +
          ".TP\n"
          "0\n"
          "success, possibly with warnings\n"
          ".TP\n"
          "1\n"
          "the result is refused, or a check failed\n"
          ".TP\n"
          "2\n"
          "error in the command line\n"
          ".TP\n"
          "3\n"
          "invalid input file\n"
          ".TP\n"
          "4\n"
          "an output cannot be written\n";
  return text;
}

std::vector<std::string> option_names(const SubcommandDefinition& subcommand) {
  std::vector<std::string> names;
  for (const OptionDefinition& option : subcommand.options) {
    if (!option.is_argument) {
      names.insert(names.end(), option.names.begin(), option.names.end());
    }
  }
  return names;
}

std::vector<std::string> subcommand_names(const ProgramDefinition& program) {
  std::vector<std::string> names;
  for (const SubcommandDefinition& subcommand : program.subcommands) {
    names.push_back(subcommand.name);
  }
  return names;
}

// Returns the values that completion proposes: OptionDefinition::values, then the words of a type
// such as "a|b|c".
std::vector<std::string> choices_of(const OptionDefinition& option) {
  std::vector<std::string> choices = option.values;
  if (option.type.find('|') != std::string::npos) {
    for (const std::string_view choice : split(option.type, '|')) {
      choices.emplace_back(choice);
    }
  }
  std::erase_if(choices, [](const std::string& choice) {
    return choice.empty() ||
           choice.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") != std::string::npos;
  });
  return choices;
}

std::string bash_completion(const ProgramDefinition& program) {
  std::string text = formatted(
      "# bash completion for {}, generated from the definitions of its options\n"
      "_{}() {{\n"
      "  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}}\n"
      "  COMPREPLY=()\n"
      "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
      "    COMPREPLY=($(compgen -W \"{} --help --version\" -- \"$word\"))\n"
      "    return\n"
      "  fi\n"
      "  case \"${{COMP_WORDS[1]}} $before\" in\n",
      program.name, program.name, joined(subcommand_names(program), " "));
  for (const SubcommandDefinition& subcommand : program.subcommands) {
    for (const OptionDefinition& option : subcommand.options) {
      const std::vector<std::string> choices = choices_of(option);
      for (const std::string& name : option.names) {
        if (!choices.empty() && !option.is_argument) {
          text +=
              formatted("    '{} {}') COMPREPLY=($(compgen -W \"{}\" -- \"$word\")); return ;;\n",
                        subcommand.name, name, joined(choices, " "));
        }
      }
    }
  }
  text += "  esac\n  local options=\n  case \"${COMP_WORDS[1]}\" in\n";
  for (const SubcommandDefinition& subcommand : program.subcommands) {
    text += formatted("    {}) options=\"{}\" ;;\n", subcommand.name,
                      joined(option_names(subcommand), " "));
  }
  text += formatted(
      "  esac\n"
      "  if [[ $word == -* ]]; then\n"
      "    COMPREPLY=($(compgen -W \"$options\" -- \"$word\"))\n"
      "  else\n"
      "    COMPREPLY=($(compgen -f -- \"$word\"))\n"
      "  fi\n"
      "}}\n"
      "complete -o filenames -F _{} {}\n",
      program.name, program.name);
  return text;
}

// Returns the text in single quotes, for a shell.
std::string shell_quoted(const std::string& text) {
  std::string safe = "'";
  for (const char c : text) {
    safe += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return safe + "'";
}

std::string zsh_completion(const ProgramDefinition& program) {
  const auto within_brackets = [](std::string text) {
    for (std::size_t at = 0; at < text.size(); ++at) {
      if (std::string_view("[]:\\").find(text[at]) != std::string_view::npos) {
        text.insert(at++, 1, '\\');
      }
    }
    return text;
  };
  std::string text = formatted(
      "#compdef {}\n"
      "# generated from the definitions of the options\n"
      "_{}() {{\n"
      "  if (( CURRENT == 2 )); then\n"
      "    local -a subcommands=(\n",
      program.name, program.name);
  for (const SubcommandDefinition& subcommand : program.subcommands) {
    text +=
        formatted("      {}\n", shell_quoted(formatted("{}:{}", subcommand.name, subcommand.help)));
  }
  text +=
      "    )\n"
      "    _describe subcommand subcommands\n"
      "    return\n"
      "  fi\n"
      "  local subcommand=$words[2]\n"
      "  shift words\n"
      "  (( CURRENT-- ))\n"
      "  case $subcommand in\n";
  for (const SubcommandDefinition& subcommand : program.subcommands) {
    text += formatted("    {})\n      _arguments \\\n", subcommand.name);
    for (const OptionDefinition& option : subcommand.options) {
      if (option.is_argument) {
        continue;
      }
      for (const std::string& name : option.names) {
        std::string entry = formatted("{}[{}]", name, within_brackets(option.help));
        if (!option.type.empty()) {
          const std::vector<std::string> choices = choices_of(option);
          entry +=
              formatted(":{}{}", within_brackets(option.type),
                        choices.empty() ? ":_files" : formatted(":({})", joined(choices, " ")));
        }
        text += formatted("        {} \\\n", shell_quoted(entry));
      }
    }
    text += "        '*:file:_files' ;;\n";
  }
  return formatted("{}  esac\n}}\n_{} \"$@\"\n", text, program.name);
}

std::string fish_completion(const ProgramDefinition& program) {
  const std::string start = "complete -c " + program.name;
  std::string text = formatted(
      "# fish completion for {}, generated from the definitions of its options\n", program.name);
  for (const SubcommandDefinition& subcommand : program.subcommands) {
    text += formatted("{} -n __fish_use_subcommand -f -a {} -d {}\n", start, subcommand.name,
                      shell_quoted(subcommand.help));
    const std::string within = formatted(
        "{} -n {}", start, shell_quoted("__fish_seen_subcommand_from " + subcommand.name));
    for (const OptionDefinition& option : subcommand.options) {
      if (option.is_argument) {
        continue;
      }
      text += within;
      for (const std::string& name : option.names) {
        text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      const std::vector<std::string> choices = choices_of(option);
      text += option.type.empty() ? "" : " -r";
      text += choices.empty() ? "" : " -f -a " + shell_quoted(joined(choices, " "));
      text += formatted(" -d {}\n", shell_quoted(option.help));
    }
  }
  return text;
}

// Escapes a text for a cell of a Markdown table.
std::string markdown(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    safe += c == '|' || c == '<' || c == '*' || c == '_' ? std::string("\\") + c
            : c == '\n'                                  ? std::string(" ")
                                                         : std::string(1, c);
  }
  return safe;
}

// Returns the text of the page docs/options.md, which lists all options.
std::string markdown_page(const ProgramDefinition& program) {
  std::string text =
      "# Every option\n\nThis page has the texts of `axiscal SUBCOMMAND --help-all`. The value of "
      "an option may start with a minus sign. A file named `-` is standard input or output.\n";
  for (const SubcommandDefinition& subcommand : program.subcommands) {
    text += formatted("\n## {}\n\n{}.\n\n| | |\n| --- | --- |\n", subcommand.name,
                      markdown(subcommand.help));
    for (const OptionDefinition& option : subcommand.options) {
      std::vector<std::string> names;
      for (const std::string& name : option.names) {
        names.push_back(formatted("`{}`", name));
      }
      text +=
          formatted("| {}{} | {} |\n", joined(names),
                    option.type.empty() || option.is_argument ? "" : " " + markdown(option.type),
                    markdown(option.help));
    }
    text += formatted("\n```sh\n{}\n```\n", joined(subcommand.examples, "\n"));
  }
  return text;
}

}  // namespace

std::string generated(const ProgramDefinition& program, std::string_view kind) {
  if (kind == "markdown") {
    return markdown_page(program);
  }
  if (kind == "man") {
    return man_page(program);
  }
  if (kind == "bash") {
    return bash_completion(program);
  }
  if (kind == "zsh") {
    return zsh_completion(program);
  }
  return kind == "fish" ? fish_completion(program) : "";
}

}  // namespace axiscal::cli

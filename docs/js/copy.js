// SPDX-License-Identifier: Apache-2.0
// The copy button of a block of commands copies the commands alone, whole: neither prompts nor what they
// print.
document.addEventListener(
  "click",
  (event) => {
    const button = event.target.closest("button[data-clipboard-target]");
    const code = button && document.querySelector(button.dataset.clipboardTarget);
    if (!code || !/^\$ /m.test(code.textContent)) {
      return;
    }
    const commands = [];
    let open = false;
    let until = "";
    for (const line of code.textContent.split("\n")) {
      const text = line.startsWith("$ ") ? line.slice(2) : open ? line : null;
      if (text === null) {
        continue;
      }
      commands.push(text);
      const here = line.startsWith("$ ") ? line.match(/<<-?'?(\w+)'?/) : null;
      until = here ? here[1] : line.startsWith("$ ") ? "" : until;
      open = until ? text !== until : text.endsWith("\\");
    }
    button.removeAttribute("data-clipboard-target");
    button.dataset.clipboardText = `${commands.join("\n")}\n`;
  },
  true,
);

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# install_test.sh BUILD PYTHON FOLDER: installs the Python package into its own prefix, copies it into a virtual
# environment with the system's packages, and runs the README's lines there.
set -euo pipefail
build=$1 python=$2 folder=$3
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
DESTDIR="$scratch/root" cmake --install "$build" --component python --prefix /usr >"$scratch/log"
package="$scratch/root/usr/$folder/axiscal"
[ -e "$package/py.typed" ] && ls "$package"/_axiscal*.so >/dev/null || { cat "$scratch/log"; exit 1; }

"$python" -m venv --system-site-packages "$scratch/venv" || { echo "skipped: no venv"; exit 77; }
site=$("$scratch/venv/bin/python" -c "import sysconfig; print(sysconfig.get_paths()['purelib'])")
cp -r "$package" "$site/"
cat >"$scratch/run.csv" <<'CSV'
rest,fence,x,y,z
-Z,+X,0.0101,-0.0202,2.5303
-Z,-X,0.0099,-0.0198,2.5301
+Z,+X,0.0102,-0.0201,-2.4703
+Z,-X,0.0101,-0.0199,-2.4702
-X,+Y,2.5102,-0.0202,0.0301
-X,-Y,2.5101,-0.0203,0.0302
+X,+Y,-2.4902,-0.0199,0.0299
+X,-Y,-2.4901,-0.0201,0.0303
-Y,+X,0.0103,2.4798,0.0301
-Y,-X,0.0101,2.4802,0.0299
+Y,+X,0.0099,-2.5201,0.0301
+Y,-X,0.0102,-2.5199,0.0302
CSV
cd "$scratch"
env -u PYTHONPATH "$scratch/venv/bin/python" - <<'PY'
import axiscal as ax
cal = ax.calibrate("run.csv", instrument=ax.accelerometer("V"), field=ax.gravity())
assert abs(cal.bias[0] - 0.01) < 1e-3, cal.bias
cal.save("cal.json")
assert ax.load("cal.json") == cal
print(ax.__file__, cal["x.bias"])
PY

"""The Python package with libassay, built by the project's Makefile: pip install --no-build-isolation tools/python"""

import shutil
import subprocess
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py

top = Path(__file__).resolve().parents[2]
made = top / "build"
(made / "python").mkdir(parents=True, exist_ok=True)


class Build(build_py):
    def run(self):
        super().run()
        subprocess.run(["make", "-s", "-C", str(top), "library"], check=True)
        for name in ("libassay.so.1", "oiio.so"):
            shutil.copy(made / name, Path(self.build_lib) / "assay" / name)


class Binary(Distribution):
    def has_ext_modules(self):  # the wheel is platform-specific
        return True


setup(
    name="assay",
    version=next(line.split()[-1] for line in open(top / "Makefile") if line.startswith("VERSION")),
    description="Compare renders: equivalent, different, and what could have been missed",
    packages=["assay"],
    install_requires=["numpy"],
    python_requires=">=3.9",
    cmdclass={"build_py": Build},
    distclass=Binary,
    # Keep build products out of the sources.
    options={"build": {"build_base": str(made / "python")}, "egg_info": {"egg_base": str(made / "python")}},
)

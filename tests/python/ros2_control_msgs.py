"""Makes GripperCommand and ParallelGripperCommand of control_msgs for rclpy, as its package would be: no registry of Python
packages has it. ROS 2's own generators make the sources, the system's compiler one library of them; for .deps/ros2's Python.

    python ros2_control_msgs.py FOLDER     into FOLDER/control_msgs
"""

import json
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy
from rosidl_adapter import convert_to_idl
from rosidl_generator_c import generate_c
from rosidl_generator_py.generate_py_impl import generate_py
from rosidl_generator_type_description import generate_type_hash
from rosidl_typesupport_c import generate_c as generate_dispatch
from rosidl_typesupport_fastrtps_c import generate_typesupport_fastrtps_c
from rosidl_typesupport_introspection_c import generate_c as generate_introspection

PACKAGE = "control_msgs"
STATE = "float64 position\nfloat64 effort\nbool stalled\nbool reached_goal\n"
SOURCES = {
    "msg/GripperCommand.msg": "float64 position\nfloat64 max_effort\n",
    "action/GripperCommand.action": f"GripperCommand command\n---\n{STATE}---\n{STATE}",
    "action/ParallelGripperCommand.action": "sensor_msgs/JointState command\n---\n{0}bool stalled\nbool reached_goal\n---\n{0}".format("sensor_msgs/JointState state\n"),
}
BELOW = ["action_msgs", "builtin_interfaces", "geometry_msgs", "sensor_msgs", "service_msgs", "std_msgs", "unique_identifier_msgs"]
FAST, INTROSPECTION = "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"


def share(package):
    return Path(sys.prefix) / "share" / package


class Generation:
    def __init__(self, folder):
        self.folder = folder
        self.idl = []
        for name, text in SOURCES.items():
            source = folder / "source" / name
            source.parent.mkdir(parents=True, exist_ok=True)
            source.write_text(text)
            convert_to_idl(folder / "source", PACKAGE, Path(name), folder / "source")
            self.idl.append(str(Path(name).with_suffix(".idl")))

    def arguments(self, generator, output=None, **more):
        below = [f"{package}:{idl}" for package in BELOW for idl in share(package).glob("*/*.idl")]
        words = {
            "package_name": PACKAGE,
            "output_dir": str(self.folder / (output or f"{generator}/{PACKAGE}")),
            "template_dir": str(share(generator) / "resource"),
            "idl_tuples": [f"{self.folder / 'source'}:{idl}" for idl in self.idl],
            "ros_interface_dependencies": below,
            "include_paths": [f"{package}:{share(package)}" for package in BELOW],
            "target_dependencies": [],
            **more,
        }
        words["target_dependencies"] = [str(self.folder / "source" / idl) for idl in self.idl]
        path = self.folder / f"{generator}.json"
        path.write_text(json.dumps(words))
        return str(path)

    def run(self):
        hashes = self.folder / "hashes"
        generate_type_hash(self.arguments("rosidl_generator_type_description", "hashes"))
        described = {"type_description_tuples": [f"{idl}:{(hashes / idl).with_suffix('.json')}" for idl in self.idl]}
        generate_c(self.arguments("rosidl_generator_c", **described))
        generate_typesupport_fastrtps_c(self.arguments(FAST))
        generate_introspection(self.arguments(INTROSPECTION))
        generate_dispatch(self.arguments("rosidl_typesupport_c"), [FAST, INTROSPECTION])
        generate_py(self.arguments("rosidl_generator_py", PACKAGE), ["rosidl_typesupport_c"])


def compile_all(folder):
    """All that was generated as one library, which Python finds as the package's."""
    prefix = Path(sys.prefix)
    for generator in ("rosidl_generator_c", FAST, INTROSPECTION):
        words = [f"#define {generator.upper()}_{kind}_{PACKAGE}" for kind in ("EXPORT", "IMPORT", "PUBLIC")]
        (folder / generator / PACKAGE / "msg" / f"{generator}__visibility_control.h").write_text("\n".join(words) + "\n")
    generated = [folder / generator for generator in ("rosidl_generator_c", FAST, INTROSPECTION, "rosidl_typesupport_c")]
    folders = [*generated, prefix / "include", sysconfig.get_paths()["include"], numpy.get_include(), *(prefix / "include").iterdir()]
    options = ["-w", "-O0", "-fPIC", *(f"-I{path}" for path in folders)]
    sources = [source for place in [*generated, folder / PACKAGE] for source in place.rglob("*.c*")]
    objects = []
    for source in sources:
        objects.append(folder / f"{len(objects)}.o")
        compiler = ["g++", "-std=c++17"] if source.suffix == ".cpp" else ["gcc"]
        subprocess.run([*compiler, *options, "-c", str(source), "-o", str(objects[-1])], check=True)
    library = folder / PACKAGE / f"{PACKAGE}_s__rosidl_typesupport_c.so"
    parts = ["generator_c", "generator_py", "typesupport_c", "typesupport_fastrtps_c", "typesupport_introspection_c"]
    below = [f"-l{package}__rosidl_{part}" for package in BELOW for part in parts]
    runtime = ["-lrosidl_runtime_c", "-lrosidl_typesupport_c", "-lrosidl_typesupport_fastrtps_c"]
    runtime += ["-lrosidl_typesupport_fastrtps_cpp", "-lrosidl_typesupport_introspection_c", "-lfastcdr"]
    command = ["g++", "-shared", "-o", str(library), *map(str, objects), f"-L{prefix / 'lib'}", *below, *runtime]
    subprocess.run(command, check=True)
    for generator in (FAST, INTROSPECTION):  # each is searched for by its own name
        (folder / f"lib{PACKAGE}__{generator}.so").symlink_to(library)


def main():
    folder = Path(sys.argv[1])
    Generation(folder).run()
    compile_all(folder)


if __name__ == "__main__":
    main()

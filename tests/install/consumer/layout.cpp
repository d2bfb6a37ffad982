// Sizes, alignments and offsets of the types in the library's interface: the same with any compiler flags.
#include <cstddef>
#include <cstdio>

#include "steadyhand/files.hpp"
#include "steadyhand/planning.hpp"

#pragma GCC diagnostic ignored "-Winvalid-offsetof"
#define SHOW(type) std::printf(#type " %zu %zu\n", sizeof(steadyhand::type), alignof(steadyhand::type))
#define SHOW_MEMBER(type, member) std::printf(#type "::" #member " %zu\n", offsetof(steadyhand::type, member))

int main() {
  SHOW(Pose);
  SHOW(JointVector);
  SHOW(StateVector);
  SHOW(OperatorSample);
  SHOW(Target);
  SHOW(Reference);
  SHOW_MEMBER(Reference, tools);
  SHOW(Plan);
  SHOW_MEMBER(Plan, x);
  SHOW_MEMBER(Plan, u);
  SHOW(JointCommand);
  SHOW_MEMBER(JointCommand, ddq);
  SHOW(RobotModel);
  SHOW_MEMBER(RobotModel, home);
  SHOW(OcpInstance);
  SHOW(Solution);
  SHOW(Kinematics);
  SHOW(Lanes);
  SHOW(NodeOf<steadyhand::Lanes>);
  SHOW(Predictor);
  SHOW(PipelineSettings);
  SHOW(Pipeline);
}

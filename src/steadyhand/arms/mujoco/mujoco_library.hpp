#pragma once

#include <mujoco/mujoco.h>

#include <filesystem>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/shared_library.hpp"

namespace steadyhand {

/// What is used of MuJoCo, with the names of its headers.
struct MujocoLibrary {
  SharedLibrary in;
  decltype(&::mj_camlight) mj_camlight = in("mj_camlight");
  decltype(&::mj_comPos) mj_comPos = in("mj_comPos");
  decltype(&::mj_compile) mj_compile = in("mj_compile");
  decltype(&::mj_contactForce) mj_contactForce = in("mj_contactForce");
  decltype(&::mj_copyModel) mj_copyModel = in("mj_copyModel");
  decltype(&::mj_deleteData) mj_deleteData = in("mj_deleteData");
  decltype(&::mj_deleteModel) mj_deleteModel = in("mj_deleteModel");
  decltype(&::mj_deleteSpec) mj_deleteSpec = in("mj_deleteSpec");
  decltype(&::mj_forward) mj_forward = in("mj_forward");
  decltype(&::mj_id2name) mj_id2name = in("mj_id2name");
  decltype(&::mj_kinematics) mj_kinematics = in("mj_kinematics");
  decltype(&::mj_makeData) mj_makeData = in("mj_makeData");
  decltype(&::mj_makeSpec) mj_makeSpec = in("mj_makeSpec");
  decltype(&::mj_mulM) mj_mulM = in("mj_mulM");
  decltype(&::mj_name2id) mj_name2id = in("mj_name2id");
  decltype(&::mj_objectVelocity) mj_objectVelocity = in("mj_objectVelocity");
  decltype(&::mj_parseXML) mj_parseXML = in("mj_parseXML");
  decltype(&::mj_step1) mj_step1 = in("mj_step1");
  decltype(&::mj_step2) mj_step2 = in("mj_step2");
  decltype(&::mj_tendon) mj_tendon = in("mj_tendon");
  decltype(&::mj_version) mj_version = in("mj_version");
  decltype(&::mj_versionString) mj_versionString = in("mj_versionString");
  decltype(&::mjr_defaultContext) mjr_defaultContext = in("mjr_defaultContext");
  decltype(&::mjr_freeContext) mjr_freeContext = in("mjr_freeContext");
  decltype(&::mjr_makeContext) mjr_makeContext = in("mjr_makeContext");
  decltype(&::mjr_readPixels) mjr_readPixels = in("mjr_readPixels");
  decltype(&::mjr_render) mjr_render = in("mjr_render");
  decltype(&::mjr_setBuffer) mjr_setBuffer = in("mjr_setBuffer");
  decltype(&::mjs_addActuator) mjs_addActuator = in("mjs_addActuator");
  decltype(&::mjs_addBody) mjs_addBody = in("mjs_addBody");
  decltype(&::mjs_addFrame) mjs_addFrame = in("mjs_addFrame");
  decltype(&::mjs_addGeom) mjs_addGeom = in("mjs_addGeom");
  decltype(&::mjs_addJoint) mjs_addJoint = in("mjs_addJoint");
  decltype(&::mjs_attach) mjs_attach = in("mjs_attach");
  decltype(&::mjs_findBody) mjs_findBody = in("mjs_findBody");
  decltype(&::mjs_getError) mjs_getError = in("mjs_getError");
  decltype(&::mjs_getSpec) mjs_getSpec = in("mjs_getSpec");
  decltype(&::mjs_setName) mjs_setName = in("mjs_setName");
  decltype(&::mjs_setString) mjs_setString = in("mjs_setString");
  decltype(&::mju_quat2Mat) mju_quat2Mat = in("mju_quat2Mat");
  decltype(&::mju_user_warning) mju_user_warning = in("mju_user_warning");
  decltype(&::mjv_defaultCamera) mjv_defaultCamera = in("mjv_defaultCamera");
  decltype(&::mjv_defaultOption) mjv_defaultOption = in("mjv_defaultOption");
  decltype(&::mjv_defaultScene) mjv_defaultScene = in("mjv_defaultScene");
  decltype(&::mjv_freeScene) mjv_freeScene = in("mjv_freeScene");
  decltype(&::mjv_makeScene) mjv_makeScene = in("mjv_makeScene");
  decltype(&::mjv_updateScene) mjv_updateScene = in("mjv_updateScene");
};

/// Loads MuJoCo, once; any thread. It is looked for as `mujoco/libmujoco.so.*` in these folders of Python packages,
/// then where the dynamic loader looks. If it is missing or not of the headers' version, fails with what to install.
Status load_mujoco(const std::vector<std::filesystem::path>& packages = {});

/// @pre load_mujoco() has succeeded
const MujocoLibrary& mujoco();

}  // namespace steadyhand

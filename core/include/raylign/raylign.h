#pragma once

// All of the library but files, which raylign/io.h has. docs/library.md shows how the parts go together.
#include "raylign/backend.h"
#include "raylign/backends.h"
#include "raylign/camera.h"
#include "raylign/error.h"
#include "raylign/intensity.h"
#include "raylign/joint_motion.h"
#include "raylign/phantom.h"
#include "raylign/registration.h"
#include "raylign/simulate.h"
#include "raylign/start.h"
#include "raylign/statistics.h"
#include "raylign/study.h"
#include "raylign/targets.h"
#include "raylign/tracking.h"
#include "raylign/version.h"
#include "raylign/xray.h"

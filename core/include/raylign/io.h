#pragma once

// Files: needs the component io of the installed package.
#include "raylign/io/decoding.h"
#include "raylign/io/frames.h"
#include "raylign/io/geometry.h"
#include "raylign/io/image.h"
#include "raylign/io/landmarks.h"
#include "raylign/io/pose.h"
#include "raylign/io/trajectory.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"

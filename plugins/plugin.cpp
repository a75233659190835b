// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/gst.h>

#include "plugins/chromamatte/chromamatte.h"
#include "plugins/composite/composite.h"
#include "plugins/contourfind/contourfind.h"
#include "plugins/gaussblur/gaussblur.h"
#include "plugins/hullbuild/hullbuild.h"
#include "plugins/hullexport/hullexport.h"
#include "plugins/hulltexture/hulltexture.h"
#include "plugins/rigtestsrc/rigtestsrc.h"
#include "plugins/scenesrc/scenesrc.h"
#include "plugins/serialtrigger/serialtrigger.h"
#include "plugins/silhouette/silhouette.h"

static gboolean plugin_init(GstPlugin* plugin) {
  gboolean any = FALSE;
  any |= GST_ELEMENT_REGISTER(rigtestsrc, plugin);
  any |= GST_ELEMENT_REGISTER(chromamatte, plugin);
  any |= GST_ELEMENT_REGISTER(gaussblur, plugin);
  any |= GST_ELEMENT_REGISTER(contourfind, plugin);
  any |= GST_ELEMENT_REGISTER(silhouette, plugin);
  any |= GST_ELEMENT_REGISTER(hullbuild, plugin);
  any |= GST_ELEMENT_REGISTER(hullexport, plugin);
  any |= GST_ELEMENT_REGISTER(serialtrigger, plugin);
  any |= GST_ELEMENT_REGISTER(scenesrc, plugin);
  any |= GST_ELEMENT_REGISTER(hulltexture, plugin);
  any |= GST_ELEMENT_REGISTER(composite, plugin);
  return any;
}

GST_PLUGIN_DEFINE(GST_VERSION_MAJOR, GST_VERSION_MINOR, polyhull,
                  "Live subjects as textured visual hulls in synthetic scenes", plugin_init,
                  PACKAGE_VERSION, "LGPL", "polyhull", "polyhull")

// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/gst.h>

GST_ELEMENT_REGISTER_DECLARE(rigtestsrc)
GST_ELEMENT_REGISTER_DECLARE(chromamatte)
GST_ELEMENT_REGISTER_DECLARE(gaussblur)
GST_ELEMENT_REGISTER_DECLARE(contourfind)
GST_ELEMENT_REGISTER_DECLARE(silhouette)
GST_ELEMENT_REGISTER_DECLARE(hullbuild)
GST_ELEMENT_REGISTER_DECLARE(hullexport)
GST_ELEMENT_REGISTER_DECLARE(serialtrigger)
GST_ELEMENT_REGISTER_DECLARE(steadystamp)
GST_ELEMENT_REGISTER_DECLARE(takesink)
GST_ELEMENT_REGISTER_DECLARE(takesrc)
GST_ELEMENT_REGISTER_DECLARE(triggerstamp)
GST_ELEMENT_REGISTER_DECLARE(tracksrc)
GST_ELEMENT_REGISTER_DECLARE(trackstamp)
GST_ELEMENT_REGISTER_DECLARE(scenesrc)
GST_ELEMENT_REGISTER_DECLARE(hullrefine)
GST_ELEMENT_REGISTER_DECLARE(hulltexture)
GST_ELEMENT_REGISTER_DECLARE(composite)
GST_ELEMENT_REGISTER_DECLARE(viewclientsrc)
GST_ELEMENT_REGISTER_DECLARE(viewdecode)
GST_ELEMENT_REGISTER_DECLARE(viewencode)
GST_ELEMENT_REGISTER_DECLARE(viewserversink)

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
  any |= GST_ELEMENT_REGISTER(steadystamp, plugin);
  any |= GST_ELEMENT_REGISTER(takesink, plugin);
  any |= GST_ELEMENT_REGISTER(takesrc, plugin);
  any |= GST_ELEMENT_REGISTER(triggerstamp, plugin);
  any |= GST_ELEMENT_REGISTER(tracksrc, plugin);
  any |= GST_ELEMENT_REGISTER(trackstamp, plugin);
  any |= GST_ELEMENT_REGISTER(scenesrc, plugin);
  any |= GST_ELEMENT_REGISTER(hullrefine, plugin);
  any |= GST_ELEMENT_REGISTER(hulltexture, plugin);
  any |= GST_ELEMENT_REGISTER(composite, plugin);
  any |= GST_ELEMENT_REGISTER(viewclientsrc, plugin);
  any |= GST_ELEMENT_REGISTER(viewdecode, plugin);
  any |= GST_ELEMENT_REGISTER(viewencode, plugin);
  any |= GST_ELEMENT_REGISTER(viewserversink, plugin);
  return any;
}

GST_PLUGIN_DEFINE(GST_VERSION_MAJOR, GST_VERSION_MINOR, polyhull,
                  "Live subjects as textured visual hulls in synthetic scenes", plugin_init,
                  PACKAGE_VERSION, "LGPL", "polyhull", "polyhull")

// Tiles below the map: Leaflet's layers, laid into the metres of the vehicle's map.

const TILE_PX = 256;
const RADIAN = Math.PI / 180;
const DEGREE_M = 111320;
const LATITUDE_MAX = 85;
// Over a step of this length the map's metres follow from degrees in proportion.
const STEP_DEG = 1e-4;
// The layers are laid again when the middle of the map is this far from where they fit.
const APART_M = 1000;
// Below the finest tiles, where these have gaps, are those of this many zooms less.
const COARSER = 3;
const SEAM_PX = 0.6;

// East and north of a place in the map: mavlink_vehicle's projections of each firmware.
export function toLocal(earth, latitude, longitude) {
  const [latitude0, longitude0] = earth.origin;
  const turn = longitude - longitude0;
  if (earth.metres_per_degree) {
    const scale = Math.max(Math.cos(0.5 * (latitude + latitude0) * RADIAN), 0.01);
    return [turn * earth.metres_per_degree * scale, (latitude - latitude0) * earth.metres_per_degree];
  }
  const [sine, cosine] = [Math.sin(latitude * RADIAN), Math.cos(latitude * RADIAN)];
  const [sine0, cosine0] = [Math.sin(latitude0 * RADIAN), Math.cos(latitude0 * RADIAN)];
  const north = cosine0 * sine - sine0 * cosine * Math.cos(turn * RADIAN);
  const east = cosine * Math.sin(turn * RADIAN);
  const away = Math.hypot(north, east);
  const longer = away > 0 ? Math.atan2(away, sine0 * sine + cosine0 * cosine * Math.cos(turn * RADIAN)) / away : 1;
  return [east * longer * earth.radius_east_m, north * longer * earth.radius_north_m];
}

// Parts of the whole web map, from its north-western corner: https://wiki.openstreetmap.org/wiki/Slippy_map_tilenames
const column = (longitude) => (longitude + 180) / 360;
const row = (latitude) => 0.5 * (1 - Math.asinh(Math.tan(latitude * RADIAN)) / Math.PI);

// The metres of the web map's width and height, and where its corner is, if the whole were as it is
// around a place in the map.
function fitted(earth, x, y) {
  const latitude = Math.max(-LATITUDE_MAX, Math.min(LATITUDE_MAX, earth.origin[0] + y / DEGREE_M));
  const longitude = earth.origin[1] + x / (DEGREE_M * Math.cos(latitude * RADIAN));
  const [east, north] = toLocal(earth, latitude, longitude);
  const [farther] = toLocal(earth, latitude, longitude + STEP_DEG);
  const [, lower] = toLocal(earth, latitude - STEP_DEG, longitude);
  const width = (farther - east) / (column(longitude + STEP_DEG) - column(longitude));
  const height = (north - lower) / (row(latitude - STEP_DEG) - row(latitude));
  return { x, y, width, height, left: east - width * column(longitude), top: north + height * row(latitude) };
}

// Not TileLayer, which puts data: into images: the page's policy forbids that.
const Layer = L.GridLayer.extend({
  createTile({ x, y, z }, done) {
    const zoom = z + this.options.zoomOffset;
    const column = x - 2 ** zoom * Math.floor(x / 2 ** zoom);
    const tile = Object.assign(new Image(), { alt: "", onload: () => done(null, tile), onerror: () => done(true, tile) });
    tile.src = `/tile/${zoom}/${column}/${y}?token=${this.options.token}`;
    return tile;
  },
});

export class Tiles {
  constructor(link, earth, redraw) {
    Object.assign(this, { link, earth, redraw, layers: [], key: "" });
  }

  // Lays the tiles where the map is; returns whether any are shown.
  show(map) {
    const [zooms, earth, ratio] = [this.link.tiles, this.earth(), devicePixelRatio || 1];
    const { x, y } = map.view;
    const key = JSON.stringify([zooms, earth, ratio]);
    const apart = this.fit && !map.moving && Math.hypot(x - this.fit.x, y - this.fit.y) > APART_M;
    if (key !== this.key || apart) {
      this.key = key;
      this.fit = zooms && earth && fitted(earth, x, y);
      this.lay(map, zooms, ratio);
    }
    const pane = map.leaflet.getPane("tilePane");
    pane.style.opacity = document.documentElement.dataset.theme === "night" ? 0.45 : 0.8;
    const shown = pane.querySelectorAll(".leaflet-tile-loaded").length;
    if (this.fit) map.element.dataset.tiles = `${shown} ${this.layers.filter((layer) => layer.isLoading()).length}`;
    return shown > 0;
  }

  lay(map, zooms, ratio) {
    const { width, height, left, top } = this.fit || { left: 0, top: 0 };
    this.layers.forEach((layer) => layer.remove());
    // Leaflet counts pixels from the web map's corner, so that its tiles are those of the web map.
    map.frame(L.transformation(1, -left, -1, top));
    if (!this.fit) { this.layers = []; return; }
    // At Leaflet's zoom 0 a metre is a pixel.
    const zoomOffset = Math.round(Math.log2((width * ratio) / TILE_PX));
    const tileSize = L.point(width, height).divideBy(2 ** zoomOffset);
    const fewer = [COARSER, 0].filter((each) => zooms.max - each >= zooms.min);
    this.layers = fewer.map((each) => new Layer({
      token: encodeURIComponent(this.link.token), tileSize, zoomOffset, minZoom: zooms.min - zoomOffset - 2,
      minNativeZoom: zooms.min - zoomOffset, maxNativeZoom: zooms.max - each - zoomOffset,
      bounds: [[top - height, -Infinity], [top, Infinity]],
    }).on("load tileload tileunload", this.redraw).on("tileloadstart", ({ tile }) => {
      // A little wider than its place, so that no line is left between two.
      Object.assign(tile.style, { width: `${tileSize.x + SEAM_PX}px`, height: `${tileSize.y + SEAM_PX}px` });
    }).addTo(map.leaflet));
  }
}

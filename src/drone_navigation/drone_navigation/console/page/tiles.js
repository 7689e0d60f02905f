// Tiles below the map, from the console's own file, laid out in the metres of the vehicle's map.

const TILE_PX = 256;
const EQUATOR_M = 40075016.686;
const DEGREE_M = EQUATOR_M / 360;
const RADIAN = Math.PI / 180;
const LATITUDE_MAX = 85;
const IMAGES_MAX = 500;
const TILES_MAX = 200;
const ROUNDS = 5;

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

// Latitude and longitude of a place in the map; the latter may be beyond 180 degrees.
export function toGeodetic(earth, x, y) {
  let [latitude, longitude] = earth.origin;
  for (let i = 0; i < ROUNDS; i += 1) {
    const [east, north] = toLocal(earth, latitude, longitude);
    latitude = Math.max(-LATITUDE_MAX, Math.min(LATITUDE_MAX, latitude + (y - north) / DEGREE_M));
    longitude += (x - east) / (DEGREE_M * Math.cos(latitude * RADIAN));
  }
  return [latitude, longitude];
}

// Columns from the date line and rows from the north: https://wiki.openstreetmap.org/wiki/Slippy_map_tilenames
const column = (longitude, count) => ((longitude + 180) / 360) * count;
const row = (latitude, count) => 0.5 * (1 - Math.asinh(Math.tan(latitude * RADIAN)) / Math.PI) * count;
const longitudeOf = (x, count) => (x / count) * 360 - 180;
const latitudeOf = (y, count) => Math.atan(Math.sinh(Math.PI * (1 - (2 * y) / count))) / RADIAN;

export class Tiles {
  constructor(link, earth, redraw) {
    this.link = link;
    this.earth = earth;
    this.redraw = redraw;
    this.images = new Map();
  }

  // Returns how many are drawn.
  draw(context, map) {
    const zooms = this.link.tiles;
    const earth = this.earth();
    if (!zooms || !earth) return 0;
    const { clientWidth: width, clientHeight: height } = map.canvas;
    const corners = [[0, 0], [width, 0], [0, height], [width, height]].map(([px, py]) => toGeodetic(earth, ...map.toMap(px, py)));
    const scale = map.view.scale * (devicePixelRatio || 1);
    const whole = EQUATOR_M * Math.cos(corners[0][0] * RADIAN) * scale;
    const zoom = Math.max(Math.round(Math.log2(whole / TILE_PX)), zooms.min);
    const count = 2 ** zoom;
    const [xs, ys] = [corners.map(([, longitude]) => column(longitude, count)), corners.map(([latitude]) => row(latitude, count))];
    const [west, east, north, south] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)].map(Math.floor);
    if ((east - west + 1) * (south - north + 1) > TILES_MAX) return 0;
    context.save();
    context.globalAlpha = document.documentElement.dataset.theme === "night" ? 0.45 : 0.8;
    let drawn = 0;
    for (let x = west; x <= east; x += 1) {
      for (let y = Math.max(north, 0); y <= Math.min(south, count - 1); y += 1) drawn += this.tile(context, map, earth, zooms, zoom, x, y);
    }
    context.restore();
    map.canvas.dataset.tiles = `${drawn} ${[...this.images.values()].filter((image) => !image.state).length}`;
    return drawn;
  }

  // Draws one, or its part of the finest one around it that there is.
  tile(context, map, earth, zooms, zoom, x, y) {
    const count = 2 ** zoom;
    let waits = false;
    for (let up = Math.max(zoom - zooms.max, 0); zoom - up >= zooms.min; up += 1) {
      const parts = 2 ** up;
      const around = 2 ** (zoom - up);
      const place = [((Math.floor(x / parts) % around) + around) % around, Math.floor(y / parts)];
      // While it is loaded a coarser one that is there takes its place.
      const image = this.image(zoom - up, ...place, !waits);
      waits = waits || image?.state === undefined;
      if (image?.state !== "ready") continue;
      const at = (dx, dy) => map.toScreen(...toLocal(earth, latitudeOf(y + dy, count), longitudeOf(x + dx, count)));
      const [[left, top], right, bottom] = [at(0, 0), at(1, 0), at(0, 1)];
      const side = image.naturalWidth / parts;
      // A little wider, so that no line is left between two.
      const wider = side * (1 + 0.6 / Math.max(right[0] - left, 1));
      context.save();
      context.transform((right[0] - left) / side, (right[1] - top) / side, (bottom[0] - left) / side, (bottom[1] - top) / side, left, top);
      const [partX, partY] = [((x % parts) + parts) % parts, y % parts];
      context.drawImage(image, partX * side, partY * side, side, side, 0, 0, wider, wider);
      context.restore();
      return 1;
    }
    return 0;
  }

  image(zoom, x, y, load) {
    const key = `${zoom}/${x}/${y}`;
    let image = this.images.get(key);
    if (!image) {
      if (!load) return undefined;
      image = new Image();
      image.onload = () => { image.state = "ready"; this.redraw(); };
      image.onerror = () => { image.state = "none"; this.redraw(); };
      image.src = `/tile/${key}?token=${encodeURIComponent(this.link.token)}`;
      if (this.images.size >= IMAGES_MAX) this.images.delete(this.images.keys().next().value);
    } else {
      this.images.delete(key);
    }
    this.images.set(key, image);
    return image;
  }
}

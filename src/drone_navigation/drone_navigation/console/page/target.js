// A target that is to be followed, as the form names it.

const $ = (id) => document.getElementById(id);
const SOURCES = { topic: "the topic", frame: "the frame", system: "MAVLink system" };
const metres = (id) => $(id).valueAsNumber || 0;

// What would be sent, without the vehicle; null without a name.
export function target() {
  const name = $("target-name").value.trim();
  if (!name) return null;
  return {
    source: $("target-source").value, target: name, ahead: metres("target-ahead"), left: metres("target-left"),
    above: metres("target-above"), least: Math.max(metres("target-least"), 0), speed: Math.max(metres("speed"), 0),
  };
}

const side = (value, positive, negative) => (value ? [`${Math.abs(value)} m ${value < 0 ? negative : positive}`] : []);

export function describedTarget({ source, target: name, ahead, left, above }) {
  const place = [...side(ahead, "ahead", "behind"), ...side(left, "left", "right"), ...side(above, "above", "below")];
  return `${SOURCES[source]} ${name}, ${place.join(", ") || "at no distance"}`;
}

// How it is going, for the readout of the goal; "" if nothing is followed.
export function followed(found) {
  if (!found) return "";
  if (found.state === "ACQUIRING") return "looking for the target";
  if (found.state === "LOST") return `target lost${found.age === null ? "" : ` for ${found.age.toFixed(0)} s`}`;
  return found.distance === null ? "following" : `target ${found.distance.toFixed(1)} m away`;
}

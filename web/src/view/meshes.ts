import { BufferAttribute, BufferGeometry } from "three";

/** One colour's triangles of a mesh file. */
export interface MeshPart {
  geometry: BufferGeometry;
  rgba: readonly [number, number, number, number] | null;
}

interface Head {
  vertices: number;
  triangles: number;
  rgba: [number, number, number, number] | null;
}

const loaded = new Map<string, Promise<MeshPart[]>>();

/** The triangles of a mesh of the scene, fetched once. */
export function mesh(id: string): Promise<MeshPart[]> {
  let parts = loaded.get(id);
  if (parts === undefined) {
    parts = fetchMesh(id);
    loaded.set(id, parts);
    parts.catch(() => loaded.delete(id));
  }
  return parts;
}

async function fetchMesh(id: string): Promise<MeshPart[]> {
  const answer = await fetch(`./mesh/${id}${location.search}`);
  if (!answer.ok) throw new Error(`mesh ${id}: ${answer.status}`);
  return unpack(await answer.arrayBuffer());
}

function unpack(data: ArrayBuffer): MeshPart[] {
  const length = new DataView(data).getUint32(0, true);
  const heads = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))) as Head[];
  let at = 4 + length;
  return heads.map((head) => {
    const positions = new Float32Array(data, at, head.vertices * 3);
    at += positions.byteLength;
    const indices = new Uint32Array(data, at, head.triangles * 3);
    at += indices.byteLength;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    geometry.setIndex(new BufferAttribute(indices, 1));
    geometry.computeVertexNormals();
    return { geometry, rgba: head.rgba };
  });
}

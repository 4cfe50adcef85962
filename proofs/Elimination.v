(** Symmetric matrices of any size: elimination shows that their form is nowhere negative.

    A matrix is the list of its rows from the diagonal on. *)

Require Import Reals Lra List Lia.
From LtlPlan Require Import Vectors Margins.
Import ListNotations.
Open Scope R_scope.

Fixpoint inner (r v : list R) : R :=
  match r, v with b :: r', x :: v' => b * x + inner r' v' | _, _ => 0 end.

Fixpoint rows_form (M : list (list R)) (v : list R) : R :=
  match M, v with
  | (a :: r) :: M', x :: v' => a * (x * x) + 2 * x * inner r v' + rows_form M' v'
  | _, _ => 0
  end.

(** Rows of [n], [n - 1] ... numbers. *)
Fixpoint upper (n : nat) (M : list (list R)) : Prop :=
  match n, M with
  | O, [] => True
  | S m, r :: M' => length r = n /\ upper m M'
  | _, _ => False
  end.

(** ** The algorithm: pivot by pivot; a pivot of zero needs a row of zeros *)

Fixpoint lessened (k : R) (r row : list R) : list R :=
  match r, row with b :: r', m :: row' => (m - k * b) :: lessened k r' row' | _, _ => [] end.

Fixpoint reduced (a : R) (r : list R) (M : list (list R)) : list (list R) :=
  match r, M with b :: r', row :: M' => lessened (b / a) r row :: reduced a r' M' | _, _ => [] end.

Inductive eliminates : list (list R) -> Prop :=
  | eliminates_none : eliminates []
  | eliminates_pivot : forall a r M, 0 < a -> eliminates (reduced a r M) -> eliminates ((a :: r) :: M)
  | eliminates_zero : forall r M, Forall (fun b => b = 0) r -> eliminates M -> eliminates ((0 :: r) :: M).

(** ** Its soundness *)

Lemma inner_lessened : forall k r row v, length r = length row ->
  inner (lessened k r row) v = inner row v - k * inner r v.
Proof.
  induction r as [|b r IH]; intros [|m row] v L; try discriminate; cbn; [ring|].
  destruct v as [|x v]; [ring|]; injection L as L; rewrite IH by auto; ring.
Qed.

Lemma lessened_length : forall k r row, length r = length row -> length (lessened k r row) = length row.
Proof.
  induction r as [|b r IH]; intros [|m row] L; try discriminate; auto; cbn; f_equal.
  injection L as L; auto.
Qed.

Lemma reduced_upper : forall a r M, upper (length r) M -> upper (length r) (reduced a r M).
Proof.
  induction r as [|b r IH]; intros [|row M] U; auto; cbn in U; try contradiction; destruct U as [L U].
  cbn [reduced length upper]; split; [rewrite lessened_length; auto | apply IH; auto].
Qed.

Lemma reduced_form : forall a r M v, a <> 0 -> upper (length r) M ->
  rows_form (reduced a r M) v = rows_form M v - inner r v * inner r v / a.
Proof.
  induction r as [|b r IH]; intros [|row M] v N U; cbn in U; try contradiction.
  - cbn; unfold Rdiv; ring.
  - destruct U as [L U]; destruct row as [|m row]; [discriminate|]; injection L as L.
    destruct v as [|x v]; [cbn; unfold Rdiv; ring|].
    cbn [reduced lessened rows_form inner]; rewrite inner_lessened, IH by auto; field; auto.
Qed.

Lemma inner_zeros : forall r v, Forall (fun b => b = 0) r -> inner r v = 0.
Proof.
  induction r as [|b r IH]; intros [|x v] F; auto; inversion F; subst; cbn; rewrite IH by auto; ring.
Qed.

Theorem elimination_nonneg : forall M, eliminates M -> forall n v, upper n M -> 0 <= rows_form M v.
Proof.
  induction 1 as [|a r M Ha E IH | r M Z E IH]; intros n v U; [cbn; lra | |];
    (destruct n as [|n]; [destruct U|]; destruct U as [L U]; injection L as L; subst n);
    (destruct v as [|x v]; [cbn; lra|]; cbn [rows_form]).
  - specialize (IH (length r) v (reduced_upper a r M U)).
    rewrite reduced_form in IH by (auto; lra).
    pose proof (square_nonneg (x + inner r v / a)) as S.
    apply Rmult_le_compat_l with (r := a) in S; [|lra].
    replace (a * ((x + inner r v / a) * (x + inner r v / a)))
      with (a * (x * x) + 2 * x * inner r v + inner r v * inner r v / a) in S by (field; lra).
    lra.
  - rewrite inner_zeros by auto; specialize (IH (length r) v U); lra.
Qed.

(** ** Forms of points, and quadratic functions *)

Theorem elimination_semidefinite : forall Q,
  eliminates [[xx Q; xy Q; xz Q]; [yy Q; yz Q]; [zz Q]] -> semidefinite Q.
Proof.
  intros Q E a; pose proof (elimination_nonneg _ E 3 [vx a; vy a; vz a]) as P; cbn in P.
  unfold quad, form, dot, apply; cbn.
  apply Rle_trans with (1 := P ltac:(repeat split)); apply Req_le; ring.
Qed.

(** Where a quadratic function's matrix of four rows eliminates, it is nowhere negative. *)
Theorem elimination_quadratic : forall Q l k,
  eliminates [[xx Q; xy Q; xz Q; vx l]; [yy Q; yz Q; vy l]; [zz Q; vz l]; [k]] ->
  forall a, 0 <= quad Q a + 2 * dot l a + k.
Proof.
  intros Q l k E a; pose proof (elimination_nonneg _ E 4 [vx a; vy a; vz a; 1]) as P; cbn in P.
  unfold quad, form, dot, apply; cbn.
  apply Rle_trans with (1 := P ltac:(repeat split)); apply Req_le; ring.
Qed.
